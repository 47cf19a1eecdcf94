import { Stack, Text } from "@mantine/core";
import { useEffect, useState } from "react";
import type { Session } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { useLive } from "../../lib/live/hooks";
import { store } from "../../lib/live/store";
import { PageLink } from "../../ui/links";
import { LoadedRun } from "./LoadedRun";
import { RecordingChooser } from "./RecordingChooser";

/** Playback in separate steps: choose, load, move to the start, play. */
export function PlayPanel(props: { patientId: string; session: Session | null; wanted: string | null }) {
  const { patientId, session, wanted } = props;
  const run = useLive("run");
  // The level is state of this component, so that it is kept after the run.
  const [level, setLevel] = useState<number | null>(null);
  return (
    <Stack component="section" aria-label={t("station:play.title")}>
      {run ? (
        <LoadedRun run={run} />
      ) : (
        session && <RecordingChooser session={session} wanted={wanted} level={level} onLevel={setLevel} />
      )}
      <LastRun patientId={patientId} />
    </Stack>
  );
}

/** A link to the session of the run that has just ended. */
function LastRun({ patientId }: { patientId: string }) {
  const [sessionId, setSessionId] = useState<string | null>(null);
  useEffect(
    () =>
      store.onSaved((saved) => {
        if (saved.what === "run" && saved.patient_id === patientId) setSessionId(saved.session_id);
      }),
    [patientId],
  );
  if (!sessionId) return null;
  return (
    <Text>
      {t("station:play.saved")}
      <PageLink to="/sessions/$sessionId" params={{ sessionId }}>
        {t("station:play.compare")}
      </PageLink>
    </Text>
  );
}
