import { Card, Group, Stack, Text, Title } from "@mantine/core";
import { useEvents } from "../live/hooks";
import { formatClock } from "../shared/format";
import { translateServerText } from "../shared/serverText";
import { STATION } from "./words";

const SHOWN = 6;

/** What happened on the apparatus lately, newest first. Changes of mode stand in the header already. */
export function Lately() {
  const events = useEvents().filter((event) => event.code !== "mode");
  if (events.length === 0) return null;
  return (
    <Card withBorder component="section" aria-label={STATION.lately}>
      <Title order={2} size="h3" mb="sm">
        {STATION.lately}
      </Title>
      <Stack gap={4}>
        {events.slice(0, SHOWN).map((event) => (
          <Group key={`${event.at} ${event.number}`} gap="md" wrap="nowrap" align="start">
            <Text c="dimmed">{formatClock(new Date(event.at))}</Text>
            <Text>{translateServerText(event.message, event.message_key)}</Text>
          </Group>
        ))}
      </Stack>
    </Card>
  );
}
