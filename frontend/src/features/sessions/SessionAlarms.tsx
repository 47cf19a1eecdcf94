import { Card, Stack, Text, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { api } from "../../lib/api/client";
import { formatClock } from "../../lib/format";
import { translateServerText } from "../../lib/serverText";
import { ProblemNote } from "../../ui/ProblemNote";
import { ALARMS } from "./sessionMessages";

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
    <Card withBorder component="section" aria-label={ALARMS.title}>
      <Title order={2} size="h3" mb="sm">
        {ALARMS.title}
      </Title>
      <Stack gap={4}>
        {items.map((one) => (
          <Text key={one.id}>
            {one.ended_at
              ? ALARMS.acknowledged(
                  clock(one.at),
                  translateServerText(one.message, one.message_key),
                  clock(one.ended_at),
                )
              : ALARMS.notAcknowledged(clock(one.at), translateServerText(one.message, one.message_key))}
          </Text>
        ))}
      </Stack>
    </Card>
  );
}
