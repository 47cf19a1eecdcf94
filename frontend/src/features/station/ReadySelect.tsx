import { Alert, Select, Stack, Text } from "@mantine/core";
import { t } from "../../lib/i18n";
import { useReadyPatients } from "../../lib/offline";
import { ProblemNote } from "../../ui/ProblemNote";

/** Lets the user choose a patient whose session this station can start or continue without the database. */
export function ReadySelect(props: {
  chosen: string | null;
  disabled?: boolean;
  onChange: (patientId: string | null) => void;
}) {
  const ready = useReadyPatients();
  const all = ready.data ?? [];
  const chosen = all.find(({ patient }) => patient.id === props.chosen);
  return (
    <Stack gap="xs">
      <Alert color="gray" variant="outline">
        {all.length > 0 || ready.isPending
          ? t("station:offline.todaysPatients")
          : t("station:offline.noPatients")}
      </Alert>
      <Select
        size="lg"
        label={t("patients:choice.label")}
        placeholder={t("patients:choice.question")}
        data={all.map(({ patient }) => ({
          value: patient.id,
          label: t("patients:choice.nameAndNumber", { name: patient.name, number: patient.clinic_number }),
        }))}
        value={chosen?.patient.id ?? null}
        disabled={(props.disabled ?? false) || all.length === 0}
        onChange={props.onChange}
      />
      {chosen?.contraindications && (
        <Text style={{ whiteSpace: "pre-wrap" }}>
          {t("station:offline.contraindications", { what: chosen.contraindications })}
        </Text>
      )}
      <ProblemNote error={ready.error} />
    </Stack>
  );
}
