import { Alert, Button, Group, List, Text } from "@mantine/core";
import { IconAlertOctagonFilled } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { api } from "../api/client";
import { useLive, useRefusal } from "../live/hooks";
import { ProblemNote } from "./problem";

/** A latched stop, on every page: why, what to do, and the acknowledgement once that is possible. */
export function StopBanner() {
  const stop = useLive("stop");
  const refusal = useRefusal("acknowledge");
  const acknowledge = useMutation({ mutationFn: api.acknowledge });
  if (!stop) return null;
  return (
    <Alert
      color="red"
      style={{ borderWidth: "0 0 4px" }}
      variant="outline"
      bg="white"
      radius={0}
      icon={<IconAlertOctagonFilled />}
      title="The apparatus has been stopped"
      role="alert"
      data-testid="stop-banner"
    >
      <Group justify="space-between" align="end" gap="xl">
        <List size="md" spacing={4}>
          {stop.causes.map((cause) => (
            <List.Item key={`${cause.code}-${cause.axis}`}>
              <Text span fw={600}>
                {cause.message}
              </Text>{" "}
              {cause.cleared ? "This has cleared. " : ""}
              {cause.next_step}
            </List.Item>
          ))}
        </List>
        <div>
          <Button
            size="lg"
            color="dark"
            disabled={refusal !== null}
            loading={acknowledge.isPending}
            onClick={() => acknowledge.mutate()}
          >
            Acknowledge
          </Button>
          <Text size="sm" maw={320} h={20}>
            {refusal ? refusal.message : "It starts nothing by itself."}
          </Text>
        </div>
      </Group>
      <ProblemNote error={acknowledge.error} />
    </Alert>
  );
}
