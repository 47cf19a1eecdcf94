import { Alert, Select, Stack, Text } from "@mantine/core";
import { useReadyPatients } from "../../lib/offline";
import { ProblemNote } from "../../ui/ProblemNote";
import { CHOICE } from "../patients/patientListMessages";
import { AWAY } from "./messages";

/** Offers the patients whose sessions this station can start or continue without the database. */
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
        {all.length > 0 || ready.isPending ? AWAY.ofToday : AWAY.nobody}
      </Alert>
      <Select
        size="lg"
        label={CHOICE.label}
        placeholder={CHOICE.who}
        data={all.map(({ patient }) => ({
          value: patient.id,
          label: CHOICE.one(patient.name, patient.clinic_number),
        }))}
        value={chosen?.patient.id ?? null}
        disabled={(props.disabled ?? false) || all.length === 0}
        onChange={props.onChange}
      />
      {chosen?.contraindications && (
        <Text style={{ whiteSpace: "pre-wrap" }}>{AWAY.contraindications(chosen.contraindications)}</Text>
      )}
      <ProblemNote error={ready.error} />
    </Stack>
  );
}
