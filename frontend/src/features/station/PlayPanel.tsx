import { Stack, Text } from "@mantine/core";
import { useState } from "react";
import type { Session } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { useLive } from "../../lib/live/hooks";
import { PageLink } from "../../ui/links";
import { LoadedRun } from "./LoadedRun";
import { RecordingChooser } from "./RecordingChooser";

/** Playback in separate steps: choose, load, move to the start, play. */
export function PlayPanel({ session, wanted }: { session: Session | null; wanted: string | null }) {
  const run = useLive("run");
  // The level is state of this component, so that it is kept after the run.
  const [level, setLevel] = useState<number | null>(null);
  return (
    <Stack component="section" aria-label={t("station:play.title")}>
      {run ? (
        <LoadedRun run={run} />
      ) : (
        session && (
          <>
            <RecordingChooser session={session} wanted={wanted} level={level} onLevel={setLevel} />
            <SavedRuns session={session} />
          </>
        )
      )}
    </Stack>
  );
}

/** A link to the session once one of its playbacks has been saved. */
function SavedRuns({ session }: { session: Session }) {
  if (!session.runs.some(({ ended_at }) => ended_at)) return null;
  return (
    <Text>
      {t("station:play.saved")}
      <PageLink to="/sessions/$sessionId" params={{ sessionId: session.id }}>
        {t("station:play.compare")}
      </PageLink>
    </Text>
  );
}
