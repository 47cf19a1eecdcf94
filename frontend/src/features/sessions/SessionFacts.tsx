import { Card, SimpleGrid, Stack, Text, Title } from "@mantine/core";
import type { Schemas, Session } from "../../lib/api/client";
import { formatClock, formatList } from "../../lib/format";
import { t } from "../../lib/i18n";
import { describeShoulder } from "./SessionResult";

const SUBJECTS: Record<string, string> = {
  ...t("common:fixtures", { returnObjects: true }),
  ...t("sessions:subjectSides", { returnObjects: true }),
  ...t("sessions:identifiers", { returnObjects: true }),
};

/** A session's summary: people, plan, result, pain and checklist. */
export function SessionFacts({ session }: { session: Session }) {
  return (
    <SimpleGrid cols={{ base: 1, md: 2 }}>
      <Card withBorder component="section" aria-label={t("sessions:facts.title")}>
        <Stack gap="xs">
          <Text>{formatList(describeParticipants(session))}</Text>
          {session.end_reason && (
            <Text data-testid="end-reason">{t(`sessions:endReasons.${session.end_reason}`)}</Text>
          )}
          <Text data-testid="pain">{describePain(session)}</Text>
          {!session.programme && <Text>{t("sessions:facts.noProgramme")}</Text>}
        </Stack>
      </Card>
      <Card withBorder component="section" aria-label={t("sessions:facts.checklist")}>
        <Title order={3} size="h4">
          {t("sessions:facts.checklist")}
        </Title>
        {session.checks.length === 0 && <Text>{t("sessions:facts.noChecks")}</Text>}
        {session.checks.map((given) => (
          <Text key={`${given.check} ${given.at}`}>
            {t("sessions:facts.answer", {
              check: describeCheck(given),
              who: given.by || t("sessions:facts.detected"),
              at: formatClock(new Date(given.at)),
            })}
          </Text>
        ))}
      </Card>
    </SimpleGrid>
  );
}

function describeParticipants({ side, therapist, station }: Session): string[] {
  return [
    describeShoulder(side),
    ...(therapist ? [t("sessions:facts.treatedBy", { therapist })] : []),
    ...(station ? [t("sessions:facts.at", { station })] : []),
  ];
}

/** Describe a check with its side or fixtures. */
function describeCheck({ check, subject }: Schemas["CheckAnswer"]): string {
  const parts = subject.split("+").map((part) => SUBJECTS[part] ?? part.replaceAll("_", " "));
  return subject
    ? t("sessions:facts.checkAndSubject", {
        check: t(`sessions:checks.${check}`),
        subject: formatList(parts),
      })
    : t(`sessions:checks.${check}`);
}

function describePain({ pain_before, pain_during, pain_after }: Session): string {
  const given = [
    ...(pain_before === null ? [] : [t("sessions:facts.before", { pain: pain_before })]),
    ...(pain_during === null ? [] : [t("sessions:facts.during", { pain: pain_during })]),
    ...(pain_after === null ? [] : [t("sessions:facts.after", { pain: pain_after })]),
  ];
  return given.length > 0
    ? t("sessions:facts.pain", { given: formatList(given) })
    : t("sessions:facts.noPain");
}
