import { Alert, Button, Group, Modal, Stack, Text } from "@mantine/core";
import { useDisclosure } from "@mantine/hooks";
import { IconEye, IconHandFinger } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { useMay } from "../access/hooks";
import { api } from "../api/client";
import { useAlive, useLive } from "../live/hooks";
import { formatClock } from "../shared/format";
import { ProblemNote } from "../shared/problem";

/** Who operates the apparatus: one person at one browser at a time. Others watch, may take over, and may always stop it. */
export function LeaseBar() {
  const alive = useAlive();
  const lease = useLive("lease");
  const mode = useLive("mode");
  const operates = useMay("operate");
  const [asking, dialog] = useDisclosure(false);
  const take = useMutation({
    mutationFn: (take_over: boolean) => api.takeLease(take_over),
    onSuccess: dialog.close,
  });
  const release = useMutation({ mutationFn: api.releaseLease });
  if (!alive || !lease) return null;
  const since = lease.since ? formatClock(new Date(lease.since)) : "";
  const moving = mode === "approaching" || mode === "playing" || mode === "paused" || mode === "returning";
  return (
    <Stack gap="xs" data-testid="lease" data-mine={lease.mine}>
      {lease.holder === null ? (
        <Text>Nobody operates the apparatus now. Whoever begins something here does.</Text>
      ) : lease.mine ? (
        <Group justify="space-between">
          <Group gap="xs">
            <IconHandFinger size={22} />
            <Text fw={600}>
              {lease.taken_from
                ? `You operate the apparatus since ${since}. You took over from ${lease.taken_from}.`
                : `You operate the apparatus since ${since}.`}
            </Text>
          </Group>
          <Button variant="default" loading={release.isPending} onClick={() => release.mutate()}>
            Release it
          </Button>
        </Group>
      ) : (
        <Alert color="indigo" variant="light" icon={<IconEye />} role="status">
          <Group justify="space-between">
            <div>
              <Text fw={600}>
                {lease.holder} operates the apparatus at another browser since {since}.
              </Text>
              <Text>
                {lease.away_since
                  ? `That browser cannot be reached since ${formatClock(new Date(lease.away_since))}.`
                  : "You watch. Stop works from here too."}
              </Text>
            </div>
            {operates && (
              <Button size="lg" variant="default" onClick={dialog.open}>
                Take over
              </Button>
            )}
          </Group>
        </Alert>
      )}
      {lease.paused && (
        <Alert color="indigo" variant="outline" role="status">
          The playback was paused because the browser that operates it could not be reached.
        </Alert>
      )}
      <ProblemNote error={release.error} />
      <Modal opened={asking} onClose={dialog.close} title={`Take over from ${lease.holder ?? "nobody"}`}>
        <Stack>
          <Text>
            {moving
              ? "The arm is being moved or held. From now on you answer for it; what goes on is not interrupted."
              : "From now on you operate the apparatus, and the other browser watches."}
          </Text>
          <Text>{lease.holder} is told at once, and it is written down.</Text>
          <ProblemNote error={take.error} />
          <Group justify="end">
            <Button variant="default" onClick={dialog.close}>
              Go on watching
            </Button>
            <Button loading={take.isPending} onClick={() => take.mutate(true)}>
              Take over
            </Button>
          </Group>
        </Stack>
      </Modal>
    </Stack>
  );
}
