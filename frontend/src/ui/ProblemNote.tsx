import { Alert } from "@mantine/core";
import { IconInfoCircle } from "@tabler/icons-react";
import { ProblemError } from "../lib/api/client";
import { PROBLEMS } from "../lib/messages";

/** What went wrong, in a sentence, and what to do. Shows nothing when nothing did. */
export function ProblemNote({ error }: { error: unknown }) {
  if (!error) return null;
  const told = error instanceof ProblemError ? error : null;
  if (told && Object.keys(told.fields).length > 0) {
    return (
      <Alert color="grape" variant="light" icon={<IconInfoCircle />} role="alert">
        {PROBLEMS.fields}
      </Alert>
    );
  }
  return (
    <Alert color="grape" variant="light" icon={<IconInfoCircle />} role="alert">
      {told ? told.message : PROBLEMS.page}
      {told?.nextStep ? ` ${told.nextStep}` : ""}
    </Alert>
  );
}
