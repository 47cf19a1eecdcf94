import { SegmentedControl } from "@mantine/core";
import { useEffect, useState } from "react";
import { t } from "../../lib/i18n";
import { useLive } from "../../lib/live/hooks";
import { useDatabaseUnavailable } from "../../lib/offline";
import { useRecordings } from "../../lib/patientQueries";

type Work = "teach" | "session";
type Panels = typeof import("./lazyStationPanels");

/**
 * Teaching and the session, one at a time, so that the controls fit on one screen. A patient without a recording is
 * taught first. Both stay mounted: what was entered in one is not lost by looking at the other.
 */
export function WorkPanels(props: { panels: Panels; patientId: string; wanted: string | null }) {
  const { panels, patientId, wanted } = props;
  const run = useLive("run");
  const teaching = useLive("teaching");
  const recordings = useRecordings(patientId).data?.items;
  const databaseUnavailable = useDatabaseUnavailable();
  const [chosen, setChosen] = useState<Work | null>(null);
  // Proposed once: a new recording must not replace the panel under the user's hand.
  useEffect(() => {
    if (chosen !== null || !recordings) return;
    setChosen(recordings.length > 0 || databaseUnavailable ? "session" : "teach");
  }, [chosen, recordings, databaseUnavailable]);
  // What the apparatus is doing takes precedence.
  const shown: Work = teaching ? "teach" : run ? "session" : (chosen ?? "session");
  return (
    <>
      {!run && !teaching && (
        <SegmentedControl
          size="md"
          fullWidth
          aria-label={t("station:work.title")}
          value={shown}
          onChange={(next) => setChosen(next as Work)}
          data={[
            { value: "teach", label: t("station:work.teach") },
            { value: "session", label: t("station:work.session") },
          ]}
        />
      )}
      {!run && (
        <div hidden={shown !== "teach"}>
          <panels.TeachPanel patientId={patientId} />
        </div>
      )}
      {!teaching && (
        <div hidden={shown !== "session"}>
          <panels.SessionWizard patientId={patientId} wanted={wanted} />
        </div>
      )}
    </>
  );
}
