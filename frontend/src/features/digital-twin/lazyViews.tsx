import { Button, Card, Group, Skeleton, Text, Title } from "@mantine/core";
import { IconCube } from "@tabler/icons-react";
import { lazy, type ReactNode, Suspense, useState } from "react";
import { t } from "../../lib/i18n";
import { useLive } from "../../lib/live/hooks";

// The three-dimensional view is half of the page's size, so it loads on demand.
const StationApparatus = lazy(() => import("./StationApparatus"));
const RecordingApparatus = lazy(() => import("./RecordingApparatus"));

const HEIGHT = 560;

/**
 * The view on the station page. It opens only without torque, because loading and preparing it can block the
 * page and Stop.
 */
export function LiveApparatus() {
  const torque = useLive("torque");
  return (
    <OpenOnDemand
      title={t("digital-twin:view.title")}
      unavailableReason={torque !== "off" && torque !== null ? t("digital-twin:view.torqueOn") : ""}
    >
      <StationApparatus />
    </OpenOnDemand>
  );
}

export function RecordingGhost({ recordingId }: { recordingId: string }) {
  return (
    <OpenOnDemand title={t("digital-twin:view.motion")} unavailableReason="">
      <RecordingApparatus recordingId={recordingId} />
    </OpenOnDemand>
  );
}

function OpenOnDemand({
  title,
  unavailableReason,
  children,
}: {
  title: string;
  unavailableReason: string;
  children: ReactNode;
}) {
  const [open, setOpen] = useState(false);
  if (open) {
    return (
      <Suspense fallback={<Skeleton h={HEIGHT} aria-label={t("digital-twin:view.drawing")} />}>
        {children}
      </Suspense>
    );
  }
  return (
    <Card withBorder component="section" aria-label={title}>
      <Group justify="space-between">
        <Title order={2} size="h3">
          {title}
        </Title>
        <Button
          variant="default"
          h={44}
          leftSection={<IconCube size={20} />}
          disabled={unavailableReason !== ""}
          onClick={() => setOpen(true)}
        >
          {t("digital-twin:view.open")}
        </Button>
      </Group>
      {unavailableReason && <Text>{unavailableReason}</Text>}
    </Card>
  );
}
