import { Select, Text } from "@mantine/core";
import { useQuery, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { api, type Schemas, type Session } from "../../lib/api/client";
import { formatDuration, formatSide } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useLive } from "../../lib/live/hooks";
import { useMaxResistanceLevel, useRecordings, useSelfPacedPermitted } from "../../lib/patientQueries";
import { ProblemNote } from "../../ui/ProblemNote";
import { ReachMargin } from "../../ui/ReachMargin";
import { SimulatedBadge } from "../../ui/SimulatedBadge";
import { MeasureEndFeel } from "../end-feel/lazyEndFeel";
import { StageWarning } from "../patients/StageWarning";
import { CommandButton } from "./CommandButton";
import { arePlayable, PlaySettings } from "./PlaySettings";
import { AS_TAUGHT, lastSettings, type Settings, settingsOf } from "./playSettingsModel";
import { lastLevel, ResistanceLevel, useLastRuns } from "./ResistanceLevel";
import { firstResistanceLevel } from "./resistanceLevels";
import { SelfPacedChoice } from "./SelfPaced";
import { PreflightChecklist, useChecklist } from "./session-wizard/PreflightChecklist";
import { isDone, nextItem } from "./session-wizard/steps";

type ChooserProps = {
  session: Session;
  wanted: string | null;
  level: number | null;
  onLevel: (level: number | null) => void;
};

const PLANNED = "planned-";

type Item = Schemas["SessionItem"];
type Recording = Schemas["Recording"];
type Options = { planned: Item[]; recorded: Recording[]; session: Session; side: Recording["side"] | null };

/** The options of the recording's select: first the planned items, then the recordings. */
function options({ planned, recorded, session, side }: Options) {
  const items = planned.map((item) => {
    const label = t("station:play.item", { position: item.position, name: item.recording_name });
    return {
      value: `${PLANNED}${item.position}`,
      label: isDone(item, session.runs) ? t("station:play.done", { item: label }) : label,
    };
  });
  const recordings = recorded.map((recording) => ({
    value: recording.id,
    label: t("station:play.recordingOption", {
      name: recording.name,
      side: formatSide(recording.side),
      lasts: formatDuration(recording.duration_s),
    }),
    disabled: recording.side !== side,
  }));
  return { items, recordings };
}

/**
 * Return the preselected option: the next planned item, else the recording that was played last, else the only
 * recording of this side. Return null if the user must choose.
 */
function preselected({ planned, recorded, session, side }: Options, lastPlayed: string | undefined) {
  const next = nextItem(planned, session.runs);
  if (next) return `${PLANNED}${next.position}`;
  const fitting = recorded.filter((recording) => recording.side === side);
  const again =
    fitting.find(({ id }) => id === lastPlayed) ?? (fitting.length === 1 ? fitting[0] : undefined);
  return again?.id ?? null;
}

/** Return the chosen item or recording, or else the preselected one. */
function useChoice(session: Session, wanted: string | null) {
  const recordings = useRecordings(session.patient.id);
  const last = useLastRuns(session.patient.id);
  const side = useLive("side");
  const [chosen, setChosen] = useState<string | null>(wanted);
  const planned = session.programme?.items ?? [];
  const recorded = (recordings.data?.items ?? []).filter((recording) => !recording.archived_at);
  const known = { planned, recorded, session, side };
  const choices = options(known);
  const enabled = [...choices.items, ...choices.recordings.filter(({ disabled }) => !disabled)];
  const value = enabled.some((option) => option.value === chosen)
    ? chosen
    : preselected(known, last.data?.at(-1)?.recording_id);
  const item = planned.find(({ position }) => `${PLANNED}${position}` === value) ?? null;
  return { recordings, last, choices, value, item, recordingId: item?.recording_id ?? value, setChosen };
}

/** The user chooses an item or a recording, its settings and its resistance level, and loads it. */
export function RecordingChooser({ session, wanted, level, onLevel }: ChooserProps) {
  const queries = useQueryClient();
  const { recordings, last, choices, value, item, recordingId, setChosen } = useChoice(session, wanted);
  const highest = useMaxResistanceLevel(session.patient.id, session.episode_id);
  const levelOfLast = lastLevel(last.data ?? []);
  const shownLevel = level ?? item?.resistance_level ?? firstResistanceLevel(levelOfLast, highest);
  // Settings are kept per recording, because a slow speed for one motion need not fit another.
  const [settings, setSettings] = useState<Record<string, Settings>>({});
  const settingsOfLast = item ? null : lastSettings(last.data ?? [], recordingId);
  const shownSettings = settings[value ?? ""] ?? (item && settingsOf(item)) ?? settingsOfLast ?? AS_TAUGHT;
  const permitted = useSelfPacedPermitted(session.patient.id, session.episode_id);
  const [pacing, setPacing] = useState<Record<string, boolean>>({});
  const selfPaced = pacing[value ?? ""] ?? item?.self_paced ?? false;
  const complete = useChecklist(session.id, recordingId).data?.complete;
  const isReady = value !== null && shownLevel !== null && arePlayable(shownSettings) && !last.isPending;
  const load = async () => {
    if (shownLevel === null) return;
    await api.load({
      session_id: session.id,
      recording_id: recordingId ?? "",
      programme_position: item?.position ?? null,
      resistance_level: shownLevel,
      self_paced: permitted && selfPaced && shownSettings.method === "smooth",
      ...shownSettings,
    });
    // Each playback has the prescribed pace unless the therapist chooses otherwise.
    setPacing({});
    // After the load, the next item of the programme is preselected again.
    if (item) setChosen(null);
    if (item) onLevel(null);
    void queries.invalidateQueries({ queryKey: ["session"] });
  };
  if (recordings.data && choices.items.length + choices.recordings.length === 0)
    return <Text>{t("station:play.noRecordings")}</Text>;
  return (
    <>
      <ProblemNote error={recordings.error ?? last.error} />
      <RecordingSelect choices={choices} value={value} onChange={setChosen} />
      {recordingId && <ChosenRecording recordingId={recordingId} />}
      {complete === false && (
        <>
          <Text fw={600}>{t("station:play.checksBeforeLoad")}</Text>
          <PreflightChecklist sessionId={session.id} recordingId={recordingId} onlyOpen />
        </>
      )}
      <PlaySettings
        value={shownSettings}
        last={settingsOfLast}
        onChange={(given) => value && setSettings({ ...settings, [value]: given })}
      />
      <SelfPacedChoice
        permitted={permitted}
        method={shownSettings.method}
        prescribed={item?.self_paced}
        value={selfPaced}
        onChange={(given) => value && setPacing({ ...pacing, [value]: given })}
      />
      <ResistanceLevel value={shownLevel} last={levelOfLast} highest={highest} onChange={onLevel} />
      <StageWarning
        patientId={session.patient.id}
        episodeId={session.episode_id}
        settings={shownSettings}
        resistanceLevel={shownLevel}
      />
      <CommandButton command="load" disabled={!isReady || complete !== true} send={load}>
        {t("station:play.load")}
      </CommandButton>
      <MeasureEndFeel session={session} level={shownLevel} />
    </>
  );
}

/** Shows the margin of the chosen recording as taught. */
function ChosenRecording({ recordingId }: { recordingId: string }) {
  const recording = useQuery({
    queryKey: ["recording", recordingId],
    queryFn: () => api.recording(recordingId),
  });
  return (
    <>
      <SimulatedBadge simulated={recording.data?.simulated} />
      {recording.data?.margin && <ReachMargin margin={recording.data.margin} />}
    </>
  );
}

function RecordingSelect(props: {
  choices: ReturnType<typeof options>;
  value: string | null;
  onChange: (value: string | null) => void;
}) {
  const { items, recordings } = props.choices;
  return (
    <Select
      size="lg"
      label={t("station:play.recording")}
      placeholder={t("station:play.choose")}
      allowDeselect={false}
      data={
        items.length === 0
          ? recordings
          : [
              { group: t("station:play.planned"), items },
              { group: t("station:play.notPlanned"), items: recordings },
            ]
      }
      value={props.value}
      onChange={props.onChange}
    />
  );
}
