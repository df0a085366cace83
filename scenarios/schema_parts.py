"""What the models of the scene format are made of: numbers, poses, and the base that knows its keys."""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticCustomError

from scenarios.names import known

Number = Annotated[float, Field(allow_inf_nan=False)]
Coordinate = Annotated[Number, Field(ge=-10, le=10)]
Extent = Annotated[Number, Field(ge=0.001, le=10)]
Degrees = Annotated[Number, Field(ge=-360, le=360)]
Triple = Field(min_length=3, max_length=3)
Position = Annotated[list[Coordinate], Triple]
Size = Annotated[list[Extent], Triple]
Angles = Annotated[list[Degrees], Triple]


class Part(BaseModel):
    """A mapping with known keys."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)

    @model_validator(mode="before")
    @classmethod
    def _keys_are_known(cls, data: Any) -> Any:
        if isinstance(data, Mapping):
            for key in data:
                if key not in cls.model_fields:
                    raise problem(str(key), f"unknown key, {known(str(key), cls.model_fields)}")
        return data


class Pose(Part):
    """A frame in W."""

    xyz: Position = Field(description="Origin in W, metres.")
    rpy_deg: Angles = Field(
        default=[0.0, 0.0, 0.0],
        description="Turn about W's fixed axes x, then y, then z (roll, pitch, yaw), in degrees.",
    )


class LevelPose(Pose):
    """A frame in W whose z points up: roll and pitch are zero."""

    @model_validator(mode="after")
    def _is_level(self) -> "LevelPose":
        if any(self.rpy_deg[:2]):
            raise problem("rpy_deg", f"roll and pitch are {self.rpy_deg[:2]}, expected zero: it stands level")
        return self


class PoseOn(Part):
    """Upright on a surface: the object's bottom rests on the table's top or the region's floor."""

    on: str = Field(description="`table`, or a region's name.")
    xy: Annotated[list[Coordinate], Field(min_length=2, max_length=2)] = Field(description="Origin in W, metres.")
    yaw_deg: Degrees = Field(default=0.0, description="Turn about W's z in degrees.")


def _pose_kind(data: Any) -> str:
    is_on = "on" in data if isinstance(data, Mapping) else isinstance(data, PoseOn)
    return "<on>" if is_on else "<xyz>"


BodyPose = Annotated[Annotated[PoseOn, Tag("<on>")] | Annotated[Pose, Tag("<xyz>")], Discriminator(_pose_kind)]


def problem(key: str, message: str) -> PydanticCustomError:
    """An error at a key of the part that is being checked."""
    return PydanticCustomError("scene", "{message}", {"message": message, "key": key})
