import { SegmentedControl } from "@mantine/core";
import { useEffect, useState } from "react";
import { t } from "../../lib/i18n";
import { useLive } from "../../lib/live/hooks";
import { useDatabaseUnavailable } from "../../lib/offline";
import { useRecordings } from "../../lib/patientQueries";
import { SessionWizard } from "./session-wizard/SessionWizard";
import classes from "./station.module.css";
import { TeachPanel } from "./TeachPanel";

type Work = "teach" | "session";

/**
 * Shows teaching or the session, so that the controls fit on one screen. For a patient without a recording it
 * first shows teaching. Both stay mounted, so that switching between them loses no input.
 */
export function WorkPanels({ patientId, wanted }: { patientId: string; wanted: string | null }) {
  const run = useLive("run");
  const teaching = useLive("teaching");
  const recordings = useRecordings(patientId).data?.items;
  const databaseUnavailable = useDatabaseUnavailable();
  const [chosen, setChosen] = useState<Work | null>(null);
  // The panel is proposed only once, because a new recording must not replace the panel that the user is using.
  useEffect(() => {
    if (chosen !== null || !recordings) return;
    setChosen(recordings.length > 0 || databaseUnavailable ? "session" : "teach");
  }, [chosen, recordings, databaseUnavailable]);
  // The present activity of the apparatus takes precedence.
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
        <div hidden={shown !== "teach"} className={classes.work}>
          <TeachPanel patientId={patientId} />
        </div>
      )}
      {!teaching && (
        <div hidden={shown !== "session"} className={classes.work} data-loaded={run !== null}>
          <SessionWizard patientId={patientId} wanted={wanted} />
        </div>
      )}
    </>
  );
}
