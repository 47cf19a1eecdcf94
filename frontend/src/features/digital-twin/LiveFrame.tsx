import { Card, Group, Title } from "@mantine/core";
import type { ReactNode } from "react";
import { t } from "../../lib/i18n";
import classes from "./digitalTwin.module.css";

/**
 * The card of the live view. It has its final height before anything is drawn, so that nothing moves
 * afterwards.
 */
export function LiveFrame({ note, children }: { note?: ReactNode; children: ReactNode }) {
  return (
    <Card
      withBorder
      padding="sm"
      className={classes.liveFrame ?? ""}
      component="section"
      aria-label={t("digital-twin:view.title")}
    >
      <Group justify="space-between" mb={4}>
        <Title order={2} size="h4">
          {t("digital-twin:view.title")}
        </Title>
        {note}
      </Group>
      {children}
    </Card>
  );
}
