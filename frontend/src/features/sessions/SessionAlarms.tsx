import { Card, Stack, Text } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { api } from "../../lib/api/client";
import { formatClock } from "../../lib/format";
import { t } from "../../lib/i18n";
import { translateServerText } from "../../lib/serverText";
import { ProblemNote } from "../../ui/ProblemNote";
import { TitleWithHelp } from "../../ui/TitleWithHelp";

const clock = (moment: string) => formatClock(new Date(moment));

/** The stops of a session and their acknowledgements. */
export function SessionAlarms({ sessionId }: { sessionId: string }) {
  const alarms = useQuery({
    queryKey: ["session", sessionId, "alarms"],
    queryFn: () => api.sessionAlarms(sessionId),
  });
  if (alarms.error) return <ProblemNote error={alarms.error} />;
  const items = alarms.data?.items ?? [];
  if (items.length === 0) return null;
  return (
    <Card withBorder component="section" aria-label={t("sessions:alarms.title")}>
      <TitleWithHelp order={2} size="h3" mb="sm" topic="alarms">
        {t("sessions:alarms.title")}
      </TitleWithHelp>
      <Stack gap={4}>
        {items.map((alarm) => (
          <Text key={alarm.id}>
            {alarm.ended_at
              ? t("sessions:alarms.acknowledged", {
                  at: clock(alarm.at),
                  what: translateServerText(alarm.message, alarm.message_key),
                  ended: clock(alarm.ended_at),
                })
              : t("sessions:alarms.notAcknowledged", {
                  at: clock(alarm.at),
                  what: translateServerText(alarm.message, alarm.message_key),
                })}
          </Text>
        ))}
      </Stack>
    </Card>
  );
}
