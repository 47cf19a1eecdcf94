import { Alert, Button, Group, List, Text } from "@mantine/core";
import { IconAlertOctagonFilled } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { useOperates } from "../access/hooks";
import { api } from "../api/client";
import { useAlive, useLive, useRefusal } from "../live/hooks";
import { ProblemNote } from "./problem";

const LETS_GO = "Support the arm first: it will sink. Pressing Stop lets it go, too.";

/** A latched stop, on every page: why, what to do, and the acknowledgement once that is possible. */
export function StopBanner() {
  const alive = useAlive();
  const operates = useOperates();
  const stop = useLive("stop");
  const refusal = useRefusal("acknowledge");
  const acknowledge = useMutation({ mutationFn: api.acknowledge });
  if (!stop) return null;
  const held = alive && stop.arm_held;
  return (
    <Alert
      color="red"
      style={{ borderWidth: "0 0 4px" }}
      variant="outline"
      bg="white"
      radius={0}
      icon={<IconAlertOctagonFilled />}
      title={
        <Text inherit fz="lg">
          {held ? "Stopped. The motors still hold the arm" : "The apparatus has been stopped"}
        </Text>
      }
      role="alert"
      data-testid="stop-banner"
    >
      <Group justify="space-between" align="start" gap="xl">
        <List size="md" spacing={4} flex="1 1 20rem">
          {stop.causes.map((cause) => (
            <List.Item key={`${cause.code}-${cause.axis}`}>
              <Text span fw={600}>
                {cause.message}
              </Text>{" "}
              {cause.cleared && !held ? "This has cleared. " : ""}
              {cause.next_step}
            </List.Item>
          ))}
        </List>
        {operates ? (
          <div>
            <Button
              size="lg"
              color="dark"
              disabled={refusal !== null}
              loading={acknowledge.isPending}
              onClick={() => acknowledge.mutate()}
            >
              {held ? "Acknowledge and let the arm go" : "Acknowledge"}
            </Button>
            <Text size="sm" maw={320} mih={20} {...(held && { fw: 600 })}>
              {refusal ? refusal.message : held ? LETS_GO : "It starts nothing by itself."}
            </Text>
          </div>
        ) : (
          <Text maw={320}>
            Whoever operates the apparatus acknowledges it, signed in and with the screen unlocked.
          </Text>
        )}
      </Group>
      <ProblemNote error={acknowledge.error} />
    </Alert>
  );
}
