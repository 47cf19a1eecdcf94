"""The list of contraindications and precautions, and what each does. Pure data.

Sources, by the abbreviation used below:

- Kisner: Kisner C, Colby LA, "Therapeutic Exercise: Foundations and Techniques" (6th edition, 2012). Chapter 4, contraindications to
  stretching (recent fracture without bony union, acute inflammatory or infectious process, haematoma) and precautions (newly united
  fracture, known or suspected osteoporosis). Chapter 5, precautions of joint mobilization (malignancy, bone disease, unhealed fracture,
  total joint replacement, hypermobility, newly formed connective tissue after surgery). Motion is not to be done where it disrupts healing.
- ASSET: Thigpen CA et al., "The American Society of Shoulder and Elbow Therapists' consensus statement on rehabilitation following
  arthroscopic rotator cuff repair", J Shoulder Elbow Surg 2016; 25: 521-535: strict immobilization first, then staged passive motion.

No publication says which condition forbids this apparatus. Where neither source decides, the effect is the clinic's decision and says so.
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
"""block: nothing is taught or played. sign_off: only after a doctor has allowed it. warn: shown in the banner."""
Scope = Literal["patient", "episode"]
"""Of the patient, for both shoulders; or of one episode's shoulder."""


@dataclass(frozen=True)
class Kind:
    """One entry of the list."""

    code: Code
    scope: Scope
    effect: Effect
    name: Text
    source: Text
    """Where the effect comes from."""


_KISNER: Final = texts.SOURCE_KISNER()
_ASSET: Final = texts.SOURCE_ASSET()
_CLINIC: Final = texts.SOURCE_CLINIC()

_LIST: Final = (
    Kind("fracture", "episode", "block", texts.CONTRAINDICATION_FRACTURE(), _KISNER),
    # Neither source names it. An unreduced or recently reduced joint has no stable centre to turn about.
    Kind("dislocation", "episode", "block", texts.CONTRAINDICATION_DISLOCATION(), _CLINIC),
    Kind("infection", "episode", "block", texts.CONTRAINDICATION_INFECTION(), _KISNER),
    # Kisner calls malignancy a precaution of mobilization. That motors may not move it is the clinic's decision.
    Kind("tumour", "episode", "block", texts.CONTRAINDICATION_TUMOUR(), _CLINIC),
    Kind("thrombosis", "episode", "block", texts.CONTRAINDICATION_THROMBOSIS(), _CLINIC),
    Kind("recent_repair", "episode", "sign_off", texts.CONTRAINDICATION_RECENT_REPAIR(), _ASSET),
    Kind("joint_replacement", "episode", "sign_off", texts.CONTRAINDICATION_JOINT_REPLACEMENT(), _KISNER),
    Kind("nerve_injury", "episode", "sign_off", texts.CONTRAINDICATION_NERVE_INJURY(), _CLINIC),
    Kind("crps", "episode", "sign_off", texts.CONTRAINDICATION_CRPS(), _CLINIC),
    Kind("osteoporosis", "patient", "warn", texts.CONTRAINDICATION_OSTEOPOROSIS(), _KISNER),
    Kind("hypermobility", "patient", "warn", texts.CONTRAINDICATION_HYPERMOBILITY(), _KISNER),
    Kind("anticoagulation", "patient", "warn", texts.CONTRAINDICATION_ANTICOAGULATION(), _CLINIC),
    # The apparatus' electromagnetic emission has not been measured.
    Kind("pacemaker", "patient", "sign_off", texts.CONTRAINDICATION_PACEMAKER(), _CLINIC),
    Kind("pregnancy", "patient", "sign_off", texts.CONTRAINDICATION_PREGNANCY(), _CLINIC),
    # Its gravity is unknown to the program, so a doctor decides.
    Kind("other", "episode", "sign_off", texts.CONTRAINDICATION_OTHER(), _CLINIC),
)
KINDS: Final[Mapping[str, Kind]] = MappingProxyType({kind.code: kind for kind in _LIST})
"""By code, in the order of the form."""


def kind_of(code: str) -> Kind:
    """Return the kind of a stored code. A code of another version counts as ``other``, which needs a doctor's permission."""
    return KINDS.get(code, KINDS["other"])
