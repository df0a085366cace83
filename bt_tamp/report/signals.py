"""What was measured during a run: a table that grows cheaply, and its file.

`signals.npz` holds, for n samples, m contacts, b bodies (times in s, simulated; frame W; metres, N, Nm, rad):
t (n,); q, v, tau, q_ref (n,7); opening, grip_force (n,); wrist (n,6) force before torque, in the flange's
frame; p_ref (n,3) set-point of the tool while in contact, else NaN; force, force_ref (n,) measured and
wanted contact force; poses (n,b,7) position and quaternion xyzw, NaN for what isn't there; bodies (b,) their names;
contact_t (m,); contact_pair (m,2) indices into contact_names; contact_p, contact_f (m,3) point, and force on
the pair's first.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin

from sim.plant import Observation

NO_POINT = np.full(3, np.nan)
_SCALARS = 5
_FIXED = _SCALARS + 4 * 7 + 6 + 3


@dataclass(frozen=True)
class Reference:
    """What the controller followed at one instant.

    q: configuration (7,) in rad. p_WG: set-point (3,) in metres of the tool while it is in contact,
    None in free space. force: contact force wanted along −z, in N.
    """

    q: np.ndarray
    p_WG: np.ndarray | None = None
    force: float = 0.0


@dataclass(frozen=True)
class Contact:
    """A contact point: two names, position p_W (3,) in metres, force_W (3,) in N on the first."""

    first: str
    second: str
    p_W: np.ndarray
    force_W: np.ndarray


class SignalTable:
    """Rows of samples in one growing array, contacts in another."""

    def __init__(self, bodies: Sequence[str]) -> None:
        self.bodies = tuple(bodies)
        self._rows = np.empty((1024, _FIXED + 7 * len(self.bodies)))
        self._count = 0
        self._contacts = np.empty((256, 9))
        self._contact_count = 0
        self._names: dict[str, int] = {}

    def __len__(self) -> int:
        return self._count

    def add(self, observation: Observation, reference: Reference, force: float) -> None:
        """One sample: what was observed, what was followed, the measured contact force in N."""
        if self._count == len(self._rows):
            self._rows = np.concatenate([self._rows, np.empty_like(self._rows)])
        row = self._rows[self._count]
        row[:_SCALARS] = (observation.t, observation.opening, observation.grip_force, force, reference.force)
        row[5:12] = observation.q
        row[12:19] = observation.v
        row[19:26] = observation.tau
        row[26:33] = reference.q
        row[33:36] = observation.wrist.force
        row[36:39] = observation.wrist.torque
        row[39:42] = NO_POINT if reference.p_WG is None else reference.p_WG
        start = _FIXED
        for name in self.bodies:
            X_WO = observation.poses.get(name)
            row[start : start + 7] = np.nan if X_WO is None else pin.SE3ToXYZQUAT(X_WO)
            start += 7
        self._count += 1

    def add_contacts(self, t: float, contacts: Sequence[Contact]) -> None:
        """The contact points at time t (s)."""
        for contact in contacts:
            if self._contact_count == len(self._contacts):
                self._contacts = np.concatenate([self._contacts, np.empty_like(self._contacts)])
            row = self._contacts[self._contact_count]
            row[:3] = (t, self._index(contact.first), self._index(contact.second))
            row[3:6] = contact.p_W
            row[6:9] = contact.force_W
            self._contact_count += 1

    def _index(self, name: str) -> int:
        return self._names.setdefault(name, len(self._names))

    def save(self, path: Path) -> None:
        """Write the file described above."""
        rows, contacts = self._rows[: self._count], self._contacts[: self._contact_count]
        with path.open("wb") as file:
            np.savez_compressed(
                file,
                t=rows[:, 0],
                opening=rows[:, 1],
                grip_force=rows[:, 2],
                force=rows[:, 3],
                force_ref=rows[:, 4],
                q=rows[:, 5:12],
                v=rows[:, 12:19],
                tau=rows[:, 19:26],
                q_ref=rows[:, 26:33],
                wrist=rows[:, 33:39],
                p_ref=rows[:, 39:42],
                poses=rows[:, _FIXED:].reshape(len(rows), len(self.bodies), 7),
                bodies=np.array(self.bodies, dtype=np.str_),
                contact_t=contacts[:, 0],
                contact_pair=contacts[:, 1:3].astype(np.int32),
                contact_p=contacts[:, 3:6],
                contact_f=contacts[:, 6:9],
                contact_names=np.array(list(self._names), dtype=np.str_),
            )


@dataclass(frozen=True)
class Signals:
    """A signals file, read. Fields as at the top of this module."""

    t: np.ndarray
    opening: np.ndarray
    grip_force: np.ndarray
    force: np.ndarray
    force_ref: np.ndarray
    q: np.ndarray
    v: np.ndarray
    tau: np.ndarray
    q_ref: np.ndarray
    wrist: np.ndarray
    p_ref: np.ndarray
    poses: np.ndarray
    bodies: np.ndarray
    contact_t: np.ndarray
    contact_pair: np.ndarray
    contact_p: np.ndarray
    contact_f: np.ndarray
    contact_names: np.ndarray

    @staticmethod
    def load(path: Path) -> "Signals":
        """Read a signals file. Raises ValueError naming the file when it isn't one."""
        try:
            with np.load(path, allow_pickle=False) as archive:
                return Signals(**{name: archive[name] for name in archive.files})
        except (OSError, TypeError, ValueError, EOFError) as error:
            raise ValueError(f"{path}: not a run's signals ({error})") from None
