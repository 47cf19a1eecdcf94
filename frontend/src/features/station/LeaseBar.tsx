import { Alert, Button, Group, Modal, Stack, Text } from "@mantine/core";
import { useDisclosure } from "@mantine/hooks";
import { IconEye, IconHandFinger } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { api, type Live } from "../../lib/api/client";
import { formatClock } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useAlive, useLive } from "../../lib/live/hooks";
import { useControlsArm } from "../../safety/useControlsArm";
import { ProblemNote } from "../../ui/ProblemNote";
import { useHasPermission } from "../auth/hooks";

type Lease = NonNullable<Live["lease"]>;

/**
 * Shows who operates the apparatus. Only one user in one browser can operate it at a time. Others can watch,
 * take over, and always stop it.
 */
export function LeaseBar() {
  const alive = useAlive();
  const lease = useLive("lease");
  const [confirming, dialog] = useDisclosure(false);
  const release = useMutation({ mutationFn: api.releaseLease });
  if (!alive || !lease) return null;
  return (
    <Stack gap="xs" data-testid="lease" data-mine={lease.mine}>
      {lease.holder === null ? (
        <Text size="sm">{t("station:lease.noOperator")}</Text>
      ) : lease.mine ? (
        <OwnLease lease={lease} releasing={release.isPending} onRelease={release.mutate} />
      ) : (
        <OtherLease lease={lease} holder={lease.holder} onTakeOver={dialog.open} />
      )}
      {lease.paused && (
        <Alert color="indigo" variant="outline" role="status">
          {t("station:lease.paused")}
        </Alert>
      )}
      <ProblemNote error={release.error} />
      <TakeOverDialog holder={lease.holder} opened={confirming} onClose={dialog.close} />
    </Stack>
  );
}

const describeSince = ({ since }: Lease) => (since ? formatClock(new Date(since)) : "");

function OwnLease(props: { lease: Lease; releasing: boolean; onRelease: () => void }) {
  const since = describeSince(props.lease);
  const from = props.lease.taken_from;
  return (
    <Group justify="space-between">
      <Group gap="xs" wrap="nowrap" flex="1 1 16rem">
        <IconHandFinger size={22} style={{ flex: "none" }} />
        <Text fw={600}>
          {from ? t("station:lease.youTookOver", { since, from }) : t("station:lease.you", { since })}
        </Text>
      </Group>
      <Button variant="default" loading={props.releasing} onClick={() => props.onRelease()}>
        {t("station:lease.release")}
      </Button>
    </Group>
  );
}

function OtherLease(props: { lease: Lease; holder: string; onTakeOver: () => void }) {
  const { lease, holder, onTakeOver } = props;
  const operates = useHasPermission("operate");
  return (
    <Alert color="indigo" variant="light" icon={<IconEye />} role="status">
      <Group justify="space-between">
        <div>
          <Text fw={600}>
            {t("station:lease.otherOperator", { who: holder, since: describeSince(lease) })}
          </Text>
          <Text>
            {lease.unreachable_since
              ? t("station:lease.unreachable", { since: formatClock(new Date(lease.unreachable_since)) })
              : t("station:lease.watching")}
          </Text>
        </div>
        {operates && (
          <Button size="lg" variant="default" onClick={onTakeOver}>
            {t("station:lease.takeOver")}
          </Button>
        )}
      </Group>
    </Alert>
  );
}

/** Explains the takeover, and takes over. */
function TakeOverDialog(props: { holder: string | null; opened: boolean; onClose: () => void }) {
  const { holder, opened, onClose } = props;
  const moving = useControlsArm();
  const takeOver = useMutation({ mutationFn: () => api.takeLease(true), onSuccess: onClose });
  return (
    <Modal
      opened={opened}
      onClose={onClose}
      title={
        holder === null ? t("station:lease.takeOverFree") : t("station:lease.takeOverFrom", { who: holder })
      }
    >
      <Stack>
        <Text>{moving ? t("station:lease.whileMoving") : t("station:lease.whileStill")}</Text>
        {holder !== null && <Text>{t("station:lease.otherNotified", { who: holder })}</Text>}
        <ProblemNote error={takeOver.error} />
        <Group justify="end">
          <Button variant="default" onClick={onClose}>
            {t("station:lease.keepWatching")}
          </Button>
          <Button loading={takeOver.isPending} onClick={() => takeOver.mutate()}>
            {t("station:lease.takeOver")}
          </Button>
        </Group>
      </Stack>
    </Modal>
  );
}
