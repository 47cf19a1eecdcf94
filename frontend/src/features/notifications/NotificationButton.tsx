import "./catalogue";
import { ActionIcon } from "@mantine/core";
import { IconBell } from "@tabler/icons-react";
import { lazy, useState } from "react";
import { t } from "../../lib/i18n";
import { LazyPart } from "../../ui/LazyPart";
import classes from "./notifications.module.css";
import { useNotices } from "./useNotices";

const NotificationList = lazy(() =>
  import("./NotificationList").then((module) => ({ default: module.NotificationList })),
);

/** Opens the notifications, and shows how many are unread. The list loads on first use. */
export function NotificationButton() {
  const [opened, setOpened] = useState(false);
  const found = useNotices();
  const count = found.unread;
  return (
    <>
      <ActionIcon
        variant="subtle"
        color="var(--mantine-color-text)"
        size={44}
        aria-label={t("notifications:list.open", { count })}
        onClick={() => setOpened(true)}
      >
        <IconBell size={24} />
        {count > 0 && (
          <span className={classes.count} aria-hidden>
            {count}
          </span>
        )}
      </ActionIcon>
      <LazyPart loading={null}>
        {opened && <NotificationList found={found} onClose={() => setOpened(false)} />}
      </LazyPart>
    </>
  );
}
