import { Group, Progress, Select, Stack, Text } from "@mantine/core";
import {
  IconArrowBackUp,
  IconArrowsDiagonalMinimize2,
  IconPlayerPause,
  IconPlayerPlay,
  IconTargetArrow,
} from "@tabler/icons-react";
import { useQueryClient } from "@tanstack/react-query";
import { useEffect, useState } from "react";
import { api, type Schemas, type Session } from "../../lib/api/client";
import { formatList, formatSpan, sideWord } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useAlive, useLive } from "../../lib/live/hooks";
import { store } from "../../lib/live/store";
import { useMaxLoadLevel, useRecordings } from "../../lib/patientQueries";
import { translateServerText } from "../../lib/serverText";
import { PageLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import { CommandButton } from "./CommandButton";
import { LoadLevel, lastLevel, useLastRuns } from "./LoadLevel";
import { firstLevel, LOAD_LEVELS } from "./loadLevels";
import { arePlayable, PlaySettings } from "./PlaySettings";
import { AS_TAUGHT, lastSettings, type Settings, settingsOf } from "./playSettingsModel";
import { pathWords, ReversalNotice } from "./ReversalNotice";
import { PreflightChecklist, useChecklist } from "./session-wizard/PreflightChecklist";
import { isDone, nextItem } from "./session-wizard/steps";

/** Playback in separate steps: choose, load, move to the start, play. */
export function PlayPanel(props: { patientId: string; session: Session | null; wanted: string | null }) {
  const { patientId, session, wanted } = props;
  const run = useLive("run");
  // State of this component, so that it survives the run.
  const [level, setLevel] = useState<number | null>(null);
  return (
    <Stack component="section" aria-label={t("station:play.title")}>
      {run ? (
        <Loaded run={run} />
      ) : (
        session && <Choose session={session} wanted={wanted} level={level} onLevel={setLevel} />
      )}
      <LastRun patientId={patientId} />
    </Stack>
  );
}

type Choice = {
  session: Session;
  wanted: string | null;
  level: number | null;
  onLevel: (level: number | null) => void;
};

const PLANNED = "planned-";
const itemWords = (item: string, done: boolean) => (done ? t("station:play.done", { item }) : item);

function Choose({ session, wanted, level, onLevel }: Choice) {
  const patientId = session.patient.id;
  const queries = useQueryClient();
  const recordings = useRecordings(patientId);
  const last = useLastRuns(patientId);
  const levelOfLast = lastLevel(last.data ?? []);
  const highest = useMaxLoadLevel(patientId, session.episode_id);
  const planned = session.programme?.items ?? [];
  const next = nextItem(planned, session.runs);
  const [chosen, setChosen] = useState<string | null>(wanted);
  const side = useLive("side");
  const recorded = (recordings.data?.items ?? []).filter((one) => !one.archived_at);
  const choices = [
    ...planned.map((one) => ({
      value: `${PLANNED}${one.position}`,
      label: itemWords(
        t("station:play.item", { position: one.position, name: one.recording_name }),
        isDone(one, session.runs),
      ),
    })),
    ...recorded.map((one) => ({
      value: one.id,
      label: t("station:play.recordingOption", {
        name: one.name,
        side: sideWord(one.side),
        lasts: formatSpan(one.duration_s),
      }),
      disabled: one.side !== side,
    })),
  ];
  // Preselect the next planned item, else the recording played last, else the only recording of this side.
  // Otherwise the user must choose.
  const fitting = recorded.filter((one) => one.side === side);
  const lastPlayed = last.data?.at(-1)?.recording_id;
  const again =
    fitting.find((one) => one.id === lastPlayed) ?? (fitting.length === 1 ? fitting[0] : undefined);
  const standing = next ? `${PLANNED}${next.position}` : (again?.id ?? null);
  const mayChoose = (id: string | null) => id?.startsWith(PLANNED) || fitting.some((one) => one.id === id);
  const value = choices.some((one) => one.value === chosen) && mayChoose(chosen) ? chosen : standing;
  const item = planned.find((one) => `${PLANNED}${one.position}` === value) ?? null;
  const recordingId = item?.recording_id ?? value;
  const shownLevel = level ?? item?.load_level ?? firstLevel(levelOfLast, highest);
  // Per recording: a slow speed for one motion says nothing about another.
  const [settings, setSettings] = useState<Record<string, Settings>>({});
  const settingsOfLast = item ? null : lastSettings(last.data ?? [], recordingId);
  const shownSettings = settings[value ?? ""] ?? (item && settingsOf(item)) ?? settingsOfLast ?? AS_TAUGHT;
  const checklist = useChecklist(session.id, recordingId);
  const load = async () => {
    if (shownLevel === null) return;
    await api.load({
      session_id: session.id,
      recording_id: recordingId ?? "",
      programme_position: item?.position ?? null,
      load_level: shownLevel,
      ...shownSettings,
    });
    // The next item of the programme is preselected again.
    if (item) setChosen(null);
    if (item) onLevel(null);
    void queries.invalidateQueries({ queryKey: ["session"] });
  };
  if (recordings.data && choices.length === 0) return <Text>{t("station:play.noRecordings")}</Text>;
  return (
    <>
      <ProblemNote error={recordings.error ?? last.error} />
      <Select
        size="lg"
        label={t("station:play.recording")}
        placeholder={t("station:play.choose")}
        allowDeselect={false}
        data={
          planned.length === 0
            ? choices
            : [
                { group: t("station:play.planned"), items: choices.slice(0, planned.length) },
                { group: t("station:play.notPlanned"), items: choices.slice(planned.length) },
              ]
        }
        value={value}
        onChange={setChosen}
      />
      {checklist.data?.complete === false && (
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
      <LoadLevel value={shownLevel} last={levelOfLast} highest={highest} onChange={onLevel} />
      <CommandButton
        command="load"
        disabled={
          value === null ||
          shownLevel === null ||
          !arePlayable(shownSettings) ||
          last.isPending ||
          checklist.data?.complete !== true
        }
        send={load}
      >
        {t("station:play.load")}
      </CommandButton>
    </>
  );
}

/** The loaded recording and the arm's position on it. */
export function Loaded({ run }: { run: Schemas["RunLive"] }) {
  const alive = useAlive();
  const mode = useLive("mode");
  const share = run.duration_s > 0 ? (100 * run.position_s) / run.duration_s : 0;
  return (
    <Stack className={alive ? "" : "stale"}>
      <Text size="lg" fw={600}>
        {run.recording_name ?? t("station:play.unnamed")}
        <Text span size="md" fw={400}>
          {t("station:play.level", { level: run.load_level, most: LOAD_LEVELS })}
        </Text>
      </Text>
      {run.changes.length > 0 && (
        <Text data-testid="changes">
          {t("station:play.settings", {
            changes: formatList(
              run.changes.map((one, place) => translateServerText(one, run.changes_keys[place])),
            ),
          })}
        </Text>
      )}
      {mode === "ready" && (
        <>
          <Text>{t("station:play.safetyCheck")}</Text>
          <Group align="start">
            <CommandButton
              held
              command="approach"
              send={() => api.approach(store.seen())}
              leftSection={<IconTargetArrow size={26} />}
            >
              {t("station:play.approach")}
            </CommandButton>
            <CommandButton command="unload" send={api.unload} variant="default">
              {t("station:play.cancel")}
            </CommandButton>
          </Group>
        </>
      )}
      {mode === "approaching" && (
        <Text fz={28} fw={700} role="status">
          {t("station:play.approaching", { left: formatSpan(run.left_s) })}
        </Text>
      )}
      {mode === "returning" && (
        <Text fz={28} fw={700} role="status">
          {t("station:play.returning", { left: formatSpan(run.left_s) })}
        </Text>
      )}
      {(mode === "playing" || mode === "paused") && (
        <>
          <Group justify="space-between">
            <Text fz={28} fw={700} role="status">
              {pathWords(mode, run)}
            </Text>
            <Text fz={28} data-testid="left">
              {t("station:play.remaining", { left: formatSpan(run.left_s) })}
            </Text>
          </Group>
          <Progress
            size={20}
            value={share}
            aria-label={t("station:play.progress")}
            transitionDuration={100}
          />
          {run.range_percent < 99.5 && (
            <Text size="lg" data-testid="range">
              {t("station:play.reducedRange", { percent: Math.round(run.range_percent) })}
            </Text>
          )}
          <ReversalNotice mode={mode} run={run} />
          <Group align="start">
            {mode === "paused" && (
              <CommandButton
                held
                command="play"
                send={() => api.play(store.seen())}
                leftSection={<IconPlayerPlay size={26} />}
              >
                {run.at_start && !run.reversing ? t("station:play.play") : t("station:play.playOn")}
              </CommandButton>
            )}
            {mode === "playing" && (
              <CommandButton command="pause" send={api.pause} leftSection={<IconPlayerPause size={26} />}>
                {t("station:play.pause")}
              </CommandButton>
            )}
            <CommandButton
              command="less"
              send={api.reduceRange}
              variant="default"
              leftSection={<IconArrowsDiagonalMinimize2 size={26} />}
            >
              {t("station:play.reduceRange")}
            </CommandButton>
            <CommandButton
              held
              command="return"
              send={() => api.returnArm(store.seen())}
              variant="default"
              leftSection={<IconArrowBackUp size={26} />}
            >
              {t("station:play.returnAndRelease")}
            </CommandButton>
          </Group>
        </>
      )}
    </Stack>
  );
}

/** A link to the session of the run that just ended. */
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
