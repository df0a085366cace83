"""The format of scene files, version 1.

SI units; angles in degrees, and only in keys that end in `_deg`. Frames: W is the world, z up.
Sizes are full extents. Unknown keys are errors. `json_schema` gives the same as JSON Schema.
"""

import math
from typing import Annotated, Any, ClassVar, Literal

from pydantic import ConfigDict, Field, ValidationError, model_validator

from scenarios.document import Document, KeyPath
from scenarios.errors import SceneInvalid
from scenarios.names import known
from scenarios.robots import ROBOTS
from scenarios.schema_disturbances import Entry
from scenarios.schema_parts import (
    Angles,
    BodyPose,
    Degrees,
    Extent,
    LevelPose,
    Number,
    Part,
    Pose,
    Position,
    Size,
    problem,
)
from scenarios.wording import message_of, path_of, shown

VERSION = 1

Mass = Annotated[Number, Field(gt=0, le=100, description="Mass in kg.")]
Color = Annotated[str, Field(pattern=r"^#[0-9a-fA-F]{6}([0-9a-fA-F]{2})?$", description="#rrggbb or #rrggbbaa.")]
Friction = Annotated[
    Number,
    Field(
        ge=0,
        le=10,
        description="Coulomb friction coefficient of the surface. The coefficient of two surfaces in contact is the "
        "product of both: an object of 0.5 on a table of 0.6 slides at 0.3.",
    ),
]
Home = Annotated[str | None, Field(description="The region where `clear-table` puts it; without: any bin.")]


class Round(Part):
    """A cylinder along its own z axis."""

    radius: Extent
    height: Extent


class Ball(Part):
    """A sphere."""

    radius: Extent


class Mesh(Part):
    """A convex mesh: the convex hull of points. Where these have their own origin makes no difference."""

    model_config = ConfigDict(json_schema_extra={"minProperties": 1, "maxProperties": 1})

    vertices: Annotated[list[Position], Field(min_length=4, max_length=10_000)] | None = Field(
        default=None, description="Points in metres; their convex hull, of at most 256 vertices, is taken."
    )
    file: str | None = Field(
        default=None,
        description="A Wavefront .obj file in the scene file's folder or below, in metres. It must be convex already.",
    )

    @model_validator(mode="after")
    def _is_one(self) -> "Mesh":
        if (self.vertices is None) == (self.file is None):
            raise problem("", "expected either vertices or a file")
        return self


class ConvexSolid(Part):
    """One of box, cylinder, sphere and mesh. The origin is the centre of volume."""

    model_config = ConfigDict(json_schema_extra={"minProperties": 1, "maxProperties": 1})

    box: Size | None = Field(default=None, description="Full extents along the object's x, y and z in metres.")
    cylinder: Round | None = Field(default=None, description="Radius and full height along the object's z in metres.")
    sphere: Ball | None = Field(default=None, description="Radius in metres.")
    mesh: Mesh | None = Field(default=None, description="A convex polyhedron.")

    @model_validator(mode="after")
    def _is_one(self) -> "ConvexSolid":
        fields = type(self).model_fields
        given = [key for key in fields if getattr(self, key) is not None]
        if len(given) != 1:
            raise problem("", f"{len(given)} shapes are given, expected one of {', '.join(fields)}")
        return self


class PartPose(Part):
    """The frame of a part (its centre of volume) among the other parts."""

    xyz: Position = Field(default=[0.0, 0.0, 0.0], description="Metres.")
    rpy_deg: Angles = Field(default=[0.0, 0.0, 0.0], description="About the fixed axes x, then y, then z, in degrees.")


class SolidPart(Part):
    """A convex part of a compound. All parts count in full: let them touch, but hardly overlap."""

    shape: ConvexSolid
    pose: PartPose = PartPose()


class Solid(ConvexSolid):
    """One of box, cylinder, sphere, mesh and compound. The origin is the centre of volume, which is what poses tell."""

    compound: Annotated[list[SolidPart], Field(min_length=1, max_length=64)] | None = Field(
        default=None,
        description="One rigid body of convex parts (a mug, a bowl), posed among each other about any origin.",
    )


class Robot(Part):
    """The arm, where its base stands and how it starts."""

    model: str = Field(default="iiwa14_wsg50", description="Name of the robot's model.")
    base: Pose = Field(default=Pose(xyz=[0.0, 0.0, 0.0]), description="The base frame in W.")
    q0_deg: Annotated[list[Degrees], Field(min_length=7, max_length=7)] = Field(
        default=[0.0, 20.0, 0.0, -80.0, 0.0, 80.0, 0.0], description="Start configuration, joint angles in degrees."
    )

    @model_validator(mode="after")
    def _is_known_and_within_limits(self) -> "Robot":
        if self.model not in ROBOTS:
            raise problem("model", f"unknown robot {self.model!r}, {known(self.model, ROBOTS)}")
        for i, (q, limit) in enumerate(zip(self.q0_deg, ROBOTS[self.model].q_max_deg, strict=True)):
            if abs(q) > limit:
                raise problem("q0_deg", f"joint {i + 1} is at {q}°, expected at most ±{limit:g}°")
        return self


class Table(Part):
    """The table's plate."""

    size: Size = Field(description="Full extents in metres; the last is the plate's thickness.")
    pose: LevelPose = Field(description="Pose of the plate's geometric centre.")
    friction: Friction = 0.5


class Region(Part):
    """A container: a bin has four walls; a dustpan has three, and is open at one side.

    A dustpan with a ramp stands on the table, the bottom edge of its open side flush with the
    table's top; without a ramp it is a tray beside the table, its rim below the table's edge.
    """

    kind: Literal["bin", "dustpan"]
    size: Size = Field(description="Full OUTER extents in metres, floor and walls included.")
    wall: Extent = Field(default=0.01, description="Thickness of walls and floor in metres.")
    pose: LevelPose = Field(description="Pose of the outer box's geometric centre.")
    open_side: Literal["+x", "-x", "+y", "-y"] | None = Field(
        default=None, description="The side without a wall, in the region's own frame. Dustpans only."
    )
    ramp_deg: Annotated[Number, Field(ge=1, le=45)] | None = Field(
        default=None, description="Slope of the ramp inside the open side in degrees. Without: no ramp."
    )
    friction: Friction = 0.5

    @model_validator(mode="after")
    def _is_a_container(self) -> "Region":
        if min(self.size[:2]) <= 2 * self.wall or self.size[2] <= self.wall:
            raise problem("size", f"{self.size} leaves no space inside walls of {self.wall} m, expected more")
        if self.kind == "dustpan" and self.open_side is None:
            raise problem("open_side", "is missing, expected one of +x, -x, +y, -y: a dustpan has an open side")
        if self.kind == "bin" and self.open_side is not None:
            raise problem("open_side", "a bin has four walls, expected none (or kind dustpan)")
        if self.ramp_deg is None:
            return self
        if self.open_side is None:
            raise problem("ramp_deg", "a bin has no ramp, expected none (or kind dustpan)")
        depth = self.size["xy".index(self.open_side[1])] - self.wall
        ramp = self.wall / math.tan(math.radians(self.ramp_deg))
        if ramp >= depth:
            raise problem("ramp_deg", f"the ramp is {ramp:.3f} m long, expected less than the inside's {depth:.3f} m")
        return self


class Fixed(Part):
    """Something that never moves and is in the way."""

    shape: Solid
    pose: BodyPose
    friction: Friction = 0.5
    color: Color = "#8a8f98"


class Noise(Part):
    """Uniform noise on the start pose, for every seed but 0: one stream for each object, named by seed and name."""

    xy: Annotated[Number, Field(ge=0, le=1)] = Field(default=0.0, description="Up to ± this in W's x and y, metres.")
    yaw_deg: Annotated[Number, Field(ge=0, le=180)] = Field(
        default=0.0, description="Up to ± this about W's z through the object's origin, degrees."
    )


class Thing(Part):
    """An object to be cleared away. It is a crumb if its largest extent is below the gripper's smallest grasp."""

    shape: Solid
    mass: Mass
    friction: Friction = 0.5
    color: Color = "#b8b2a7"
    pose: BodyPose
    noise: Noise | None = None
    home: Home = None


class Tool(Part):
    """A movable thing that the robot works with. A sponge is a soft box."""

    kind: Literal["sponge"]
    shape: Solid
    mass: Mass
    friction: Friction = 0.5
    contact_stiffness: Annotated[Number, Field(gt=0, le=1e6)] = Field(
        default=2000.0, description="Stiffness of each contact point in N/m."
    )
    contact_damping: Annotated[Number, Field(ge=0, le=1e5)] = Field(
        default=20.0, description="Damping of each contact point in Ns/m."
    )
    color: Color = "#f2c230"
    pose: BodyPose
    noise: Noise | None = None
    home: Home = None

    @model_validator(mode="after")
    def _is_a_box(self) -> "Tool":
        if self.shape.box is None:
            raise problem("shape", "a sponge is a box, expected {box: [x, y, z]}")
        return self


class SceneFile(Part):
    """A scene: what stands where, and what must become of it.

    Names match [a-z][a-z0-9_-]*, are given once in the whole file, and are neither PDDL keywords
    nor names of the robot's parts.
    """

    model_config: ClassVar[ConfigDict] = ConfigDict(title="bt-tamp scene, version 1")

    version: Literal[1]
    name: str = Field(description="The scene's name.")
    robot: Robot
    table: Table
    regions: dict[str, Region] = Field(default={}, max_length=50)
    fixed: dict[str, Fixed] = Field(default={}, max_length=200)
    objects: dict[str, Thing] = Field(max_length=200)
    tools: dict[str, Tool] = Field(default={}, max_length=10)
    goal: str = Field(
        description="A PDDL conjunction of positive literals: (in_bin OBJECT PLACE) lies in that bin or dustpan, or on "
        "the table; (put_away OBJECT) lies in some bin; (holding OBJECT); (hand_empty). Or `clear-table`: every crumb "
        "in the dustpan, every other object and each tool in its `home`."
    )
    disturbances: list[Entry] = Field(default=[], max_length=100, description="What goes wrong during a run, and when.")


def json_schema() -> dict[str, Any]:
    """The format as JSON Schema."""
    return SceneFile.model_json_schema()


def validate_document(document: Document) -> SceneFile:
    """Hold plain data against the format. Raises SceneInvalid with the first problem and how many more there are."""
    data = document.data
    if not isinstance(data, dict):
        raise SceneInvalid(f"expected a scene (a mapping), got {shown(data)}", document.file, document.place(()))
    if "version" not in data:
        message = f"missing key 'version', expected version: {VERSION}"
        raise SceneInvalid(message, document.file, document.place(()))
    if data["version"] != VERSION or isinstance(data["version"], bool):
        message = f"version is {shown(data['version'])}, expected {VERSION}"
        raise SceneInvalid(message, document.file, document.place(("version",)))
    try:
        return SceneFile.model_validate(data)
    except ValidationError as error:
        problems = error.errors(include_url=False)
        first = min(problems, key=lambda problem: document.line(path_of(problem)))
        raise invalid(document, path_of(first), message_of(first), len(problems) - 1) from None


def invalid(document: Document, path: KeyPath, message: str, more: int = 0) -> SceneInvalid:
    """The error for one problem at a key path, with the number of further ones."""
    rest = f" (and {more} more problem{'s' if more > 1 else ''})" if more else ""
    return SceneInvalid(message + rest, document.file, document.place(path))
