import "./catalogue";
import { Alert, List } from "@mantine/core";
import { IconInfoCircle } from "@tabler/icons-react";
import { ProblemError } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { ProblemNote } from "../../ui/ProblemNote";

/** Shows the errors of a refused file by line and column, or by path. */
export function Refused({ error }: { error: unknown }) {
  const places = error instanceof ProblemError ? error.places : [];
  if (places.length === 0) return <ProblemNote error={error} />;
  return (
    <Alert
      color="grape"
      variant="light"
      icon={<IconInfoCircle />}
      role="alert"
      title={t("import-export:file.error", { count: places.length })}
    >
      <List data-testid="places">
        {places.map(({ place, problem }) => (
          <List.Item key={`${place} ${problem}`}>
            <strong>{t("import-export:file.place", { where: place })}</strong> {problem}
          </List.Item>
        ))}
      </List>
      {error instanceof ProblemError && error.nextStep}
    </Alert>
  );
}
