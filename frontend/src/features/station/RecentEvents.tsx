import { Card, Group, Stack, Text, Title } from "@mantine/core";
import { formatClock } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useEvents } from "../../lib/live/hooks";
import { translateServerText } from "../../lib/serverText";

const SHOWN = 6;

/**
 * Recent events of the apparatus, newest first. Events of the mode are left out, because the header shows the
 * mode.
 */
export function RecentEvents() {
  const events = useEvents().filter((event) => event.code !== "mode");
  if (events.length === 0) return null;
  return (
    <Card withBorder component="section" aria-label={t("station:station.recentEvents")}>
      <Title order={2} size="h3" mb="sm">
        {t("station:station.recentEvents")}
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
