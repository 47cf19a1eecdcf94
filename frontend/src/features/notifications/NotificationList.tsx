import "./catalogue";
import { Button, Modal, Stack, Text } from "@mantine/core";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { api } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { PageLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import type { Notice } from "./notices";
import classes from "./notifications.module.css";
import { NOTICES_KEY, type Notices } from "./useNotices";

/** The notifications, newest first. The list opens below the header, so that Stop stays reachable. */
export function NotificationList({ found, onClose }: { found: Notices; onClose: () => void }) {
  const { notices, unread, failed } = found;
  const queries = useQueryClient();
  const markRead = useMutation({
    mutationFn: () => api.markNotificationsRead(notices.map(({ id }) => id)),
    onSuccess: (listed) => queries.setQueryData(NOTICES_KEY, listed),
  });
  return (
    <Modal opened onClose={onClose} title={t("notifications:list.title")} size="md">
      <Stack gap="xs">
        {failed && <Text size="sm">{t("notifications:list.failed")}</Text>}
        {notices.length === 0 && !failed && <Text>{t("notifications:list.none")}</Text>}
        <ProblemNote error={markRead.error} />
        {unread > 0 && (
          <Button variant="default" loading={markRead.isPending} onClick={() => markRead.mutate()}>
            {t("notifications:list.markRead")}
          </Button>
        )}
        <ul className={classes.list ?? ""}>
          {notices.map((notice) => (
            <Line key={notice.id} notice={notice} onOpen={onClose} />
          ))}
        </ul>
      </Stack>
    </Modal>
  );
}

function Line({ notice, onOpen }: { notice: Notice; onOpen: () => void }) {
  return (
    <li className={classes.line ?? ""}>
      <PageLink {...notice.target} fw={notice.read ? 400 : 700} onClick={onOpen}>
        {notice.words}
      </PageLink>
      <Text size="sm" c="dimmed">
        {formatMoment(notice.at)}
        {!notice.read && ` · ${t("notifications:list.unread")}`}
      </Text>
    </li>
  );
}
