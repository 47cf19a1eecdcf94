import { Card, Stack, Text, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { api } from "../api/client";
import { formatClock } from "../shared/format";
import { ProblemNote } from "../shared/problem";
import { translateServerText } from "../shared/serverText";
import { ALARMS } from "./words";

const clock = (moment: string) => formatClock(new Date(moment));

/** What stopped the apparatus in a session, and when it was acknowledged. */
export function Alarms({ sessionId }: { sessionId: string }) {
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
