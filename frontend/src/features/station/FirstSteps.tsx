import { Button, Card, Group, Stack, Text, Title } from "@mantine/core";
import { useLocalStorage } from "@mantine/hooks";
import { t } from "../../lib/i18n";
import { useNewestSession, useRecordings } from "../../lib/patientQueries";
import { ButtonLink } from "../../ui/links";
import { useMatchingPatients } from "../patients/PatientSelect";
import { FIRST_STEPS, firstStep } from "./firstSteps";

/** Guides a new user through the main tasks on the simulated apparatus, until the user hides it. */
export function FirstSteps({ patientId }: { patientId: string | null }) {
  const [hidden, setHidden] = useLocalStorage({
    key: "kata.first-steps-hidden",
    defaultValue: false,
    getInitialValueInEffect: false,
    // Unknown stored values are ignored.
    deserialize: (stored) => stored === "true",
  });
  return hidden ? null : <CurrentStep patientId={patientId} onHide={() => setHidden(true)} />;
}

/** Shows the current step as soon as it is known. */
function CurrentStep({ patientId, onHide }: { patientId: string | null; onHide: () => void }) {
  const patients = useMatchingPatients("");
  const recordings = useRecordings(patientId);
  const newestSession = useNewestSession(patientId);
  const known =
    patients.data && (patientId === null || (recordings.data && newestSession.data !== undefined));
  if (!known) return null;
  const step = firstStep({
    patients: patients.data.items.length,
    chosen: patientId !== null,
    recordings: recordings.data?.items.length ?? 0,
    session: newestSession.data ?? null,
  });
  return (
    <Card withBorder component="section" aria-label={t("station:firstSteps.title")}>
      <Stack gap="sm">
        <Group justify="space-between">
          <Title order={2} size="h4">
            {t("station:firstSteps.progress", {
              step: FIRST_STEPS.indexOf(step) + 1,
              of: FIRST_STEPS.length,
            })}
          </Title>
          <Button variant="subtle" size="md" onClick={onHide}>
            {t("station:firstSteps.hide")}
          </Button>
        </Group>
        <Text role="status">{t(`station:firstStepTexts.${step}`)}</Text>
        {step === "sign_up" && (
          <Group>
            <ButtonLink to="/patients">{t("station:firstSteps.registerPatient")}</ButtonLink>
          </Group>
        )}
      </Stack>
    </Card>
  );
}
