import { Skeleton } from "@mantine/core";
import { IconArrowsHorizontal } from "@tabler/icons-react";
import { lazy } from "react";
import type { Session } from "../../lib/api/client";
import { useDraft } from "../../lib/draft";
import { t } from "../../lib/i18n";
import { LazyPart } from "../../ui/LazyPart";
import { OpenOnDemand } from "../../ui/OpenOnDemand";

const Measurement = lazy(() =>
  import("./EndFeelMeasurement").then((module) => ({ default: module.EndFeelMeasurement })),
);
const Result = lazy(() => import("./EndFeelCard").then((module) => ({ default: module.EndFeelCard })));

const FALLBACK = <Skeleton h={300} />;

/** The guided measurement of the end-feel, at the station. It is open again after each measurement, which hides it. */
export function MeasureEndFeel({ session, level }: { session: Session; level: number | null }) {
  const [open, setOpen] = useDraft(`end-feel ${session.id} open`, false);
  return (
    <OpenOnDemand
      startsOpen={open}
      onOpen={() => setOpen(true)}
      title={t("station:play.endFeel")}
      open={t("station:play.measureEndFeel")}
      icon={<IconArrowsHorizontal size={20} />}
      fallback={FALLBACK}
    >
      <Measurement session={session} level={level} />
    </OpenOnDemand>
  );
}

/** The result of one end-feel test. */
export function EndFeelOfRun({ runId }: { runId: string }) {
  return (
    <LazyPart loading={FALLBACK}>
      <Result runId={runId} />
    </LazyPart>
  );
}
