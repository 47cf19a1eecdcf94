"""A technician who confirms every instruction and does nothing."""

from kata.commissioning.gains_review import GainsChoice
from kata.commissioning.workbench import ManualAction


class Obedient:
    """A technician of an apparatus that needs nothing."""

    def instruct(self, instruction: ManualAction) -> None:
        """Do nothing."""

    def has_confirmed(self) -> bool:
        """Agree."""
        return True

    def gains_choice(self) -> GainsChoice:
        """Keep the gains."""
        return GainsChoice("keep")
