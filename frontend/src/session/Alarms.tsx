import { Card, Stack, Text, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { api } from "../api/client";
import { formatClock } from "../shared/format";
import { ProblemNote } from "../shared/problem";

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
    <Card withBorder component="section" aria-label="Alarms">
      <Title order={2} size="h3" mb="sm">
        Alarms
      </Title>
      <Stack gap={4}>
        {items.map((one) => (
          <Text key={one.id}>
            {formatClock(new Date(one.at))}: {one.message}{" "}
            {one.ended_at
              ? `Acknowledged at ${formatClock(new Date(one.ended_at))}.`
              : "Not acknowledged yet."}
          </Text>
        ))}
      </Stack>
    </Card>
  );
}
