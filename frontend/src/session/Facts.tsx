import { Card, SimpleGrid, Stack, Text, Title } from "@mantine/core";
import type { Schemas, Session } from "../api/client";
import { formatClock, sideWord } from "../shared/format";
import { END_REASONS } from "../shared/NoteCard";

const CHECKS: Record<Schemas["CheckAnswer"]["check"], string> = {
  side: "Side, pin in",
  fixtures: "Fixtures closed",
  belt: "Belt",
  pedal: "Pedal answers",
  estop: "Emergency stop tried",
};

/** A session in short: who, what was planned and done, pain, and what the checklist was answered. */
export function Facts({ session }: { session: Session }) {
  return (
    <SimpleGrid cols={{ base: 1, md: 2 }}>
      <Card withBorder component="section" aria-label="In short">
        <Stack gap="xs">
          <Text>
            {sideWord(session.side)} shoulder
            {session.therapist ? `, treated by ${session.therapist}` : ""}
            {session.station ? `, at ${session.station}` : ""}
          </Text>
          {session.end_reason && <Text data-testid="end-reason">{END_REASONS[session.end_reason]}</Text>}
          <Text data-testid="pain">{painWords(session)}</Text>
          {!session.programme && <Text>Recordings were chosen one by one.</Text>}
        </Stack>
      </Card>
      <Card withBorder component="section" aria-label="Checklist">
        <Title order={3} size="h4">
          Checklist
        </Title>
        {session.checks.length === 0 && <Text>Nobody has gone through it.</Text>}
        {session.checks.map((one) => (
          <Text key={`${one.check} ${one.at}`}>
            {CHECKS[one.check]}
            {one.subject ? ` (${one.subject.replaceAll("_", " ").replaceAll("+", ", ")})` : ""}:{" "}
            {one.by || "seen by the apparatus"}, {formatClock(new Date(one.at))}
          </Text>
        ))}
      </Card>
    </SimpleGrid>
  );
}

function painWords({ pain_before, pain_during, pain_after }: Session): string {
  const given = [
    ["before", pain_before],
    ["during", pain_during],
    ["after", pain_after],
  ].flatMap(([when, pain]) => (pain === null ? [] : [`${pain} ${when}`]));
  return given.length > 0 ? `Pain (0 to 10): ${given.join(", ")}` : "Nobody has asked for pain.";
}
