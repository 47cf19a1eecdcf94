import { Alert, Button, Group, Modal, Stack, Text } from "@mantine/core";
import { useDisclosure } from "@mantine/hooks";
import { IconEye, IconHandFinger } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { api } from "../../lib/api/client";
import { formatClock } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useAlive, useLive } from "../../lib/live/hooks";
import { isMoving } from "../../safety/modes";
import { ProblemNote } from "../../ui/ProblemNote";
import { useHasPermission } from "../auth/hooks";

/**
 * Shows who operates the apparatus: one user in one browser at a time. Others watch, can take over, and can
 * always stop it.
 */
export function LeaseBar() {
  const alive = useAlive();
  const lease = useLive("lease");
  const mode = useLive("mode");
  const operates = useHasPermission("operate");
  const [asking, dialog] = useDisclosure(false);
  const take = useMutation({
    mutationFn: (take_over: boolean) => api.takeLease(take_over),
    onSuccess: dialog.close,
  });
  const release = useMutation({ mutationFn: api.releaseLease });
  if (!alive || !lease) return null;
  const since = lease.since ? formatClock(new Date(lease.since)) : "";
  const moving = mode !== null && isMoving(mode);
  return (
    <Stack gap="xs" data-testid="lease" data-mine={lease.mine}>
      {lease.holder === null ? (
        <Text>{t("station:lease.noOperator")}</Text>
      ) : lease.mine ? (
        <Group justify="space-between">
          <Group gap="xs">
            <IconHandFinger size={22} />
            <Text fw={600}>
              {lease.taken_from
                ? t("station:lease.youTookOver", { since, from: lease.taken_from })
                : t("station:lease.you", { since })}
            </Text>
          </Group>
          <Button variant="default" loading={release.isPending} onClick={() => release.mutate()}>
            {t("station:lease.release")}
          </Button>
        </Group>
      ) : (
        <Alert color="indigo" variant="light" icon={<IconEye />} role="status">
          <Group justify="space-between">
            <div>
              <Text fw={600}>{t("station:lease.otherOperator", { who: lease.holder, since })}</Text>
              <Text>
                {lease.unreachable_since
                  ? t("station:lease.unreachable", { since: formatClock(new Date(lease.unreachable_since)) })
                  : t("station:lease.watching")}
              </Text>
            </div>
            {operates && (
              <Button size="lg" variant="default" onClick={dialog.open}>
                {t("station:lease.takeOver")}
              </Button>
            )}
          </Group>
        </Alert>
      )}
      {lease.paused && (
        <Alert color="indigo" variant="outline" role="status">
          {t("station:lease.paused")}
        </Alert>
      )}
      <ProblemNote error={release.error} />
      <Modal
        opened={asking}
        onClose={dialog.close}
        title={
          lease.holder === null
            ? t("station:lease.takeOverFree")
            : t("station:lease.takeOverFrom", { who: lease.holder })
        }
      >
        <Stack>
          <Text>{moving ? t("station:lease.whileMoving") : t("station:lease.whileStill")}</Text>
          {lease.holder !== null && <Text>{t("station:lease.otherNotified", { who: lease.holder })}</Text>}
          <ProblemNote error={take.error} />
          <Group justify="end">
            <Button variant="default" onClick={dialog.close}>
              {t("station:lease.keepWatching")}
            </Button>
            <Button loading={take.isPending} onClick={() => take.mutate(true)}>
              {t("station:lease.takeOver")}
            </Button>
          </Group>
        </Stack>
      </Modal>
    </Stack>
  );
}
