"""The list of contraindications and precautions, and the effect of each. Pure data.

Sources, by the abbreviation used below:

- Kisner: Kisner C, Colby LA, "Therapeutic Exercise: Foundations and Techniques" (6th edition, 2012). Chapter 4, contraindications to
  stretching (recent fracture without bony union, acute inflammatory or infectious process, haematoma) and precautions (newly united
  fracture, known or suspected osteoporosis). Chapter 5, precautions of joint mobilization (malignancy, bone disease, unhealed fracture,
  total joint replacement, hypermobility, newly formed connective tissue after surgery). Motion must not disrupt healing.
- ASSET: Thigpen CA et al., "The American Society of Shoulder and Elbow Therapists' consensus statement on rehabilitation following
  arthroscopic rotator cuff repair", J Shoulder Elbow Surg 2016; 25: 521-535: strict immobilization first, then staged passive motion.

No publication says which condition forbids this apparatus. If neither source decides, the effect is the clinic's decision and is marked as
such.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, Literal

from kata.clinic import texts
from kata.messages import Text

Code = Literal[
    "fracture", "dislocation", "infection", "tumour", "thrombosis", "recent_repair", "joint_replacement", "nerve_injury", "crps",
    "osteoporosis", "hypermobility", "anticoagulation", "pacemaker", "pregnancy", "other",
]  # fmt: skip
Effect = Literal["block", "sign_off", "warn"]
"""block: teaching and playback are refused. sign_off: they are refused until a doctor allows them. warn: the banner shows a warning."""
Scope = Literal["patient", "episode"]
"""patient: concerns both shoulders. episode: concerns the shoulder of one episode."""


@dataclass(frozen=True)
class Kind:
    """One entry of the list."""

    code: Code
    scope: Scope
    effect: Effect
    name: Text
    source: Text
    """Source of the effect."""


_KISNER: Final = texts.SOURCE_KISNER()
_ASSET: Final = texts.SOURCE_ASSET()
_CLINIC: Final = texts.SOURCE_CLINIC()

_LIST: Final = (
    Kind("fracture", "episode", "block", texts.CONTRAINDICATION_FRACTURE(), _KISNER),
    # Neither source names a dislocation. An unreduced or recently reduced joint has no stable centre of rotation.
    Kind("dislocation", "episode", "block", texts.CONTRAINDICATION_DISLOCATION(), _CLINIC),
    Kind("infection", "episode", "block", texts.CONTRAINDICATION_INFECTION(), _KISNER),
    # Kisner calls malignancy a precaution of mobilization. It is the clinic's decision that motors may not move the shoulder.
    Kind("tumour", "episode", "block", texts.CONTRAINDICATION_TUMOUR(), _CLINIC),
    Kind("thrombosis", "episode", "block", texts.CONTRAINDICATION_THROMBOSIS(), _CLINIC),
    Kind("recent_repair", "episode", "sign_off", texts.CONTRAINDICATION_RECENT_REPAIR(), _ASSET),
    Kind("joint_replacement", "episode", "sign_off", texts.CONTRAINDICATION_JOINT_REPLACEMENT(), _KISNER),
    Kind("nerve_injury", "episode", "sign_off", texts.CONTRAINDICATION_NERVE_INJURY(), _CLINIC),
    Kind("crps", "episode", "sign_off", texts.CONTRAINDICATION_CRPS(), _CLINIC),
    Kind("osteoporosis", "patient", "warn", texts.CONTRAINDICATION_OSTEOPOROSIS(), _KISNER),
    Kind("hypermobility", "patient", "warn", texts.CONTRAINDICATION_HYPERMOBILITY(), _KISNER),
    Kind("anticoagulation", "patient", "warn", texts.CONTRAINDICATION_ANTICOAGULATION(), _CLINIC),
    # The electromagnetic emission of the apparatus has not been measured.
    Kind("pacemaker", "patient", "sign_off", texts.CONTRAINDICATION_PACEMAKER(), _CLINIC),
    Kind("pregnancy", "patient", "sign_off", texts.CONTRAINDICATION_PREGNANCY(), _CLINIC),
    # The program does not know how serious this is, so a doctor decides.
    Kind("other", "episode", "sign_off", texts.CONTRAINDICATION_OTHER(), _CLINIC),
)
KINDS: Final[Mapping[str, Kind]] = MappingProxyType({kind.code: kind for kind in _LIST})
"""Kinds by code, in the order of the form."""


def kind_of(code: str) -> Kind:
    """Return the kind of a stored code. A code that only another version knows counts as ``other``, which needs a doctor's permission."""
    return KINDS.get(code, KINDS["other"])
