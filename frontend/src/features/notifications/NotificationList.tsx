import { Button, Modal, Stack, Text } from "@mantine/core";
import { formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { PageLink } from "../../ui/links";
import type { Notice } from "./notices";
import classes from "./notifications.module.css";
import type { Notices } from "./useNotices";

/** The notifications, newest first. The list opens below the header, so that Stop stays reachable. */
export function NotificationList({ found, onClose }: { found: Notices; onClose: () => void }) {
  const { notices, unread, failed, markRead } = found;
  const unreadIds = new Set(unread.map(({ id }) => id));
  return (
    <Modal opened onClose={onClose} title={t("notifications:list.title")} size="md">
      <Stack gap="xs">
        {failed && <Text size="sm">{t("notifications:list.failed")}</Text>}
        {notices.length === 0 && !failed && <Text>{t("notifications:list.none")}</Text>}
        {unread.length > 0 && (
          <Button variant="default" onClick={markRead}>
            {t("notifications:list.markRead")}
          </Button>
        )}
        <ul className={classes.list ?? ""}>
          {notices.map((notice) => (
            <Line key={notice.id} notice={notice} unread={unreadIds.has(notice.id)} onOpen={onClose} />
          ))}
        </ul>
      </Stack>
    </Modal>
  );
}

function Line({ notice, unread, onOpen }: { notice: Notice; unread: boolean; onOpen: () => void }) {
  return (
    <li className={classes.line ?? ""}>
      <PageLink {...notice.target} fw={unread ? 700 : 400} onClick={onOpen}>
        {notice.words}
      </PageLink>
      <Text size="sm" c="dimmed">
        {formatMoment(notice.at)}
        {unread && ` · ${t("notifications:list.unread")}`}
      </Text>
    </li>
  );
}
