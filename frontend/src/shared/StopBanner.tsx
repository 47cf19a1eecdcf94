import { Button, Group, List, Text, Title } from "@mantine/core";
import { useMutation } from "@tanstack/react-query";
import { useOperates } from "../access/hooks";
import { AlarmFrame, useAlarms } from "../alarms/Alarms";
import { api } from "../api/client";
import { useAlive, useLive, useRefusal } from "../live/hooks";
import { ProblemNote } from "./problem";
import { told } from "./told";
import { STOPPED } from "./words";

/**
 * A latched stop: why, what to do, and the acknowledgement once that is possible. A banner on every page; on the station's it is
 * `whole`, and stands in place of what one would do next.
 */
export function StopBanner({ whole = false }: { whole?: boolean }) {
  const alive = useAlive();
  const operates = useOperates();
  const stop = useLive("stop");
  const alarm = useAlarms().find(({ code }) => code.startsWith("stop "));
  const refusal = useRefusal("acknowledge");
  const acknowledge = useMutation({ mutationFn: api.acknowledge });
  if (!stop) return null;
  const held = alive && stop.arm_held;
  const size = whole ? "xl" : "md";
  return (
    <AlarmFrame priority={alarm?.priority ?? "high"} testid="stop-banner">
      <Title order={2} fz={whole ? 36 : 20} mb="xs">
        {held ? STOPPED.titleHeld : STOPPED.title}
      </Title>
      <Group justify="space-between" align="start" gap="xl">
        <List size={size} spacing={4} flex="1 1 20rem">
          {stop.causes.map((cause) => (
            <List.Item key={`${cause.code}-${cause.axis}`}>
              <Text span inherit fw={600}>
                {told(cause.message)}
              </Text>{" "}
              {cause.cleared && !held ? STOPPED.cleared : ""}
              {told(cause.next_step)}
            </List.Item>
          ))}
        </List>
        {operates ? (
          <div>
            <Button
              size={whole ? "xl" : "lg"}
              color="dark"
              disabled={refusal !== null}
              loading={acknowledge.isPending}
              onClick={() => acknowledge.mutate()}
            >
              {held ? STOPPED.acknowledgeHeld : STOPPED.acknowledge}
            </Button>
            <Text size={whole ? "md" : "sm"} maw={320} mih={20} {...(held && { fw: 600 })}>
              {refusal ? refusal.message : held ? STOPPED.letsGo : STOPPED.startsNothing}
            </Text>
          </div>
        ) : (
          <Text maw={320}>{STOPPED.byWhom}</Text>
        )}
      </Group>
      <ProblemNote error={acknowledge.error} />
    </AlarmFrame>
  );
}
