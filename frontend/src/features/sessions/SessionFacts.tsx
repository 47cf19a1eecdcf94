import { Card, SimpleGrid, Stack, Text, Title } from "@mantine/core";
import type { Schemas, Session } from "../../lib/api/client";
import { formatClock } from "../../lib/format";
import { FIXTURES, FORMAT } from "../../lib/messages";
import { END_REASONS } from "./noteMessages";
import { CHECKS, FACTS, SUBJECT_SIDES } from "./sessionMessages";

const SUBJECTS: Record<string, string> = { ...FIXTURES, ...SUBJECT_SIDES };

/** A session's summary: people, plan, result, pain and checklist. */
export function SessionFacts({ session }: { session: Session }) {
  return (
    <SimpleGrid cols={{ base: 1, md: 2 }}>
      <Card withBorder component="section" aria-label={FACTS.title}>
        <Stack gap="xs">
          <Text>{FORMAT.list(whoWords(session))}</Text>
          {session.end_reason && <Text data-testid="end-reason">{END_REASONS[session.end_reason]}</Text>}
          <Text data-testid="pain">{painWords(session)}</Text>
          {!session.programme && <Text>{FACTS.oneByOne}</Text>}
        </Stack>
      </Card>
      <Card withBorder component="section" aria-label={FACTS.checklist}>
        <Title order={3} size="h4">
          {FACTS.checklist}
        </Title>
        {session.checks.length === 0 && <Text>{FACTS.notGone}</Text>}
        {session.checks.map((one) => (
          <Text key={`${one.check} ${one.at}`}>
            {FACTS.answer(checkWords(one), one.by || FACTS.seen, formatClock(new Date(one.at)))}
          </Text>
        ))}
      </Card>
    </SimpleGrid>
  );
}

function whoWords({ side, therapist, station }: Session): string[] {
  return [
    side === null ? FACTS.unknownShoulder : FACTS.shoulder(side),
    ...(therapist ? [FACTS.treatedBy(therapist)] : []),
    ...(station ? [FACTS.at(station)] : []),
  ];
}

/** Describe a check with its side or fixtures. */
function checkWords({ check, subject }: Schemas["CheckAnswer"]): string {
  const parts = subject.split("+").map((part) => SUBJECTS[part] ?? part.replaceAll("_", " "));
  return subject ? FACTS.about(CHECKS[check], FORMAT.list(parts)) : CHECKS[check];
}

function painWords({ pain_before, pain_during, pain_after }: Session): string {
  const given = [
    ...(pain_before === null ? [] : [FACTS.before(pain_before)]),
    ...(pain_during === null ? [] : [FACTS.during(pain_during)]),
    ...(pain_after === null ? [] : [FACTS.after(pain_after)]),
  ];
  return given.length > 0 ? FACTS.pain(FORMAT.list(given)) : FACTS.noPain;
}
