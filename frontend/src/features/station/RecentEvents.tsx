import { Card, Group, Stack, Text, Title } from "@mantine/core";
import { formatClock } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useEvents } from "../../lib/live/hooks";
import { describeEvents } from "./recentEvents";

const SHOWN = 6;

/** Recent events of the apparatus, newest first. */
export function RecentEvents() {
  const events = describeEvents(useEvents());
  if (events.length === 0) return null;
  return (
    <Card withBorder component="section" aria-label={t("station:station.recentEvents")}>
      <Title order={2} size="h3" mb="sm">
        {t("station:station.recentEvents")}
      </Title>
      <Stack gap={4}>
        {events.slice(0, SHOWN).map(({ event, text }) => (
          <Group key={`${event.at} ${event.number}`} gap="md" wrap="nowrap" align="start">
            <Text c="dimmed">{formatClock(new Date(event.at))}</Text>
            <Text>{text}</Text>
          </Group>
        ))}
      </Stack>
    </Card>
  );
}
