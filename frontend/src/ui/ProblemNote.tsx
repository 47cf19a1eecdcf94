import { Alert } from "@mantine/core";
import { IconInfoCircle } from "@tabler/icons-react";
import { ProblemError } from "../lib/api/client";
import { t } from "../lib/i18n";

/**
 * Shows an error with its next step. Renders nothing without an error. `marksFields`: false if no field beside it
 * shows its own error.
 */
export function ProblemNote({ error, marksFields = true }: { error: unknown; marksFields?: boolean }) {
  if (!error) return null;
  const problem = error instanceof ProblemError ? error : null;
  if (marksFields && problem && Object.keys(problem.fields).length > 0) {
    return (
      <Alert color="grape" variant="light" icon={<IconInfoCircle />} role="alert">
        {t("common:problems.fields")}
      </Alert>
    );
  }
  return (
    <Alert color="grape" variant="light" icon={<IconInfoCircle />} role="alert">
      {problem ? problem.message : t("common:problems.page")}
      {problem?.nextStep ? ` ${problem.nextStep}` : ""}
    </Alert>
  );
}
