"""The short list of diagnoses that a clinician can choose. Every other diagnosis is written as text and has no code.

Codes: World Health Organization, ICD-10, M75 "Shoulder lesions", S42.2 and S43.0. SNOMED CT is given where its code is certain.
"""

from dataclasses import dataclass
from typing import Final, Literal, get_args

DiagnosisCode = Literal["", "M75.0", "M75.1", "M75.2", "M75.3", "M75.4", "M75.5", "S42.2", "S43.0"]
"""ICD-10 code of the chosen diagnosis; empty if none was chosen."""
Verification = Literal["", "unconfirmed", "provisional", "differential", "confirmed"]
"""Certainty of the diagnosis, as in HL7's condition-ver-status; empty: not stated."""


@dataclass(frozen=True)
class Diagnosis:
    """One diagnosis of the list."""

    icd10: str
    english: str
    snomed: str = ""
    """SNOMED CT code with the same meaning; empty if we have verified none."""


DIAGNOSES: Final = (
    Diagnosis("M75.0", "Adhesive capsulitis of shoulder", "399114005"),
    Diagnosis("M75.1", "Rotator cuff syndrome"),
    Diagnosis("M75.2", "Bicipital tendinitis"),
    Diagnosis("M75.3", "Calcific tendinitis of shoulder"),
    Diagnosis("M75.4", "Impingement syndrome of shoulder"),
    Diagnosis("M75.5", "Bursitis of shoulder"),
    Diagnosis("S42.2", "Fracture of upper end of humerus"),
    Diagnosis("S43.0", "Dislocation of shoulder joint"),
)
BY_CODE: Final = {diagnosis.icd10: diagnosis for diagnosis in DIAGNOSES}
assert {"", *BY_CODE} == set(get_args(DiagnosisCode))
