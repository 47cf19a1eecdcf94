import "./catalogue";
import { Button, Card, NumberInput, Stack, Text, Title } from "@mantine/core";
import { useQuery, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { api, type Schemas, type Session } from "../../lib/api/client";
import { useDraft } from "../../lib/draft";
import { formatDeg } from "../../lib/format";
import { t } from "../../lib/i18n";
import { store } from "../../lib/live/store";
import { translateServerText } from "../../lib/serverText";
import { ProblemNote } from "../../ui/ProblemNote";
import { TitleWithHelp } from "../../ui/TitleWithHelp";
import { CommandButton } from "../station/CommandButton";
import { PreflightChecklist, useChecklist } from "../station/session-wizard/PreflightChecklist";
import { describeResult, describeStretch } from "./describeResult";
import { isStretch, StretchSettings, stretchRequest, USUAL_STRETCH } from "./StretchSettings";
import { isHeldAtStart, untilMode } from "./untilMode";

type Motion = Schemas["EndFeelMotion"];
/**
 * Later than this, a user who has released the button moves the arm to the start: the service refuses a command 2 s after the
 * state that its sender saw.
 */
const LOADED_WITHIN_MS = 1_500;
/** A user who still holds the button waits for a busy computer. */
const HELD_WITHIN_MS = 30_000;

type Kind = Schemas["EndFeelLoadRequest"]["kind"];

const TORQUE = { default: 1.5, min: 0.3, max: 4, step: 0.1 } as const;

/** Measures the end-feel of up to three motions: first a baseline with a test weight, then the patient's arm. */
export function EndFeelMeasurement({ session, level }: { session: Session; level: number | null }) {
  const [torque, setTorque] = useDraft<number | string>(`end-feel ${session.id} torque`, TORQUE.default);
  const guide = useQuery({
    queryKey: ["session", session.id, "end-feel"],
    queryFn: () => api.endFeelGuide(session.id),
  });
  const motions = newestOfEach(guide.data?.motions ?? []);
  return (
    <Card withBorder component="section" aria-label={t("endFeel:title")}>
      <Stack>
        <TitleWithHelp topic="endFeel" order={2} size="h3">
          {t("endFeel:title")}
        </TitleWithHelp>
        <Text fw={600}>{t("endFeel:simulatedOnly")}</Text>
        <Text>{t("endFeel:steps")}</Text>
        <ProblemNote error={guide.error} />
        <NumberInput
          size="lg"
          label={t("endFeel:torque")}
          description={t("endFeel:torqueHint")}
          min={TORQUE.min}
          max={TORQUE.max}
          step={TORQUE.step}
          decimalScale={1}
          clampBehavior="none"
          value={torque}
          onChange={setTorque}
          error={
            isTorque(torque) ? null : t("endFeel:torqueRange", { leastNm: TORQUE.min, mostNm: TORQUE.max })
          }
        />
        {level === null && <Text>{t("endFeel:levelMissing")}</Text>}
        {guide.data && motions.length === 0 && <Text>{t("endFeel:noMotion")}</Text>}
        {motions.map((motion) => (
          <MotionToMeasure
            key={motion.recording_id}
            motion={motion}
            session={session}
            torque={Number(torque)}
            speed={guide.data?.speed_deg_s ?? 0}
            level={level}
          />
        ))}
      </Stack>
    </Card>
  );
}

function isTorque(typed: number | string): boolean {
  return typed !== "" && Number(typed) >= TORQUE.min && Number(typed) <= TORQUE.max;
}

/** Return the newest recording of each motion. The service sends the newest first. */
function newestOfEach(motions: Motion[]): Motion[] {
  return motions.filter((one, place) => motions.findIndex(({ motion }) => motion === one.motion) === place);
}

type ToMeasure = { motion: Motion; session: Session; torque: number; speed: number; level: number | null };

function MotionToMeasure({ motion, session, torque, speed, level }: ToMeasure) {
  const complete = useChecklist(session.id, motion.recording_id).data?.complete;
  const last = motion.tests[0];
  const [stretch, setStretch] = useState(USUAL_STRETCH);
  const [replaced, setReplaced] = useState<string | null>(null);
  const measured = motion.baseline_run_id !== null && motion.baseline_run_id !== replaced;
  const stretched = motion.stretches[0]?.stretch;
  const can = complete === true && level !== null && isTorque(torque);
  return (
    <Stack gap="xs" data-testid="end-feel-motion">
      <Title order={3} size="h4">
        {t("endFeel:motion", {
          number: motion.motion,
          name: translateServerText(motion.name, motion.name_key),
          recording: motion.recording_name,
        })}
      </Title>
      {complete === false && (
        <PreflightChecklist sessionId={session.id} recordingId={motion.recording_id} onlyOpen />
      )}
      {last && <Text data-testid="end-feel-last">{describeResult(last)}</Text>}
      {measured ? (
        <>
          <Text>{t("endFeel:armIn")}</Text>
          <Button w="fit-content" variant="default" onClick={() => setReplaced(motion.baseline_run_id)}>
            {t("endFeel:measureAgain")}
          </Button>
          <Text>{t("station:play.safetyCheck")}</Text>
          <MeasureButton kind="test" {...{ motion, session, torque, speed, level, can }} />
          <Title order={4} size="h5">
            {t("endFeel:stretch.title")}
          </Title>
          <Text>{t("endFeel:stretch.explained")}</Text>
          {stretched && <Text data-testid="stretch-last">{describeStretch(stretched)}</Text>}
          <StretchSettings typed={stretch} change={setStretch} end={formatDeg(motion.end_deg, 0)} />
          <MeasureButton
            kind="stretch"
            {...{ motion, session, torque, speed, level }}
            can={can && isStretch(stretch)}
            settings={stretchRequest(stretch)}
          />
        </>
      ) : (
        <>
          <Text>{t(motion.baseline_run_id ? "endFeel:weightInAgain" : "endFeel:weightIn")}</Text>
          <MeasureButton kind="baseline" {...{ motion, session, torque, speed, level, can }} />
          {motion.baseline_run_id && (
            <Button w="fit-content" variant="default" onClick={() => setReplaced(null)}>
              {t("endFeel:keepBaseline")}
            </Button>
          )}
        </>
      )}
    </Stack>
  );
}

/**
 * Held for a second, it loads the way and moves to its start. A test and a stretch begin when the user holds Play. A baseline,
 * which moves a weight, begins if the user still holds the button at the start.
 */
function MeasureButton({
  kind,
  motion,
  session,
  torque,
  speed,
  level,
  can,
  settings = stretchRequest(USUAL_STRETCH),
}: ToMeasure & { kind: Kind; can: boolean; settings?: ReturnType<typeof stretchRequest> }) {
  const queries = useQueryClient();
  const measure = async (released: AbortSignal) => {
    if (level === null) return;
    const seen = store.seen();
    const run = await api.loadEndFeel({
      session_id: session.id,
      recording_id: motion.recording_id,
      kind,
      torque_nm: torque,
      resistance_level: level,
      speed_deg_s: speed,
      ...settings,
    });
    void queries.invalidateQueries({ queryKey: ["session"] });
    const ready = { mode: "ready", runId: run.id } as const;
    const soon = await untilMode(store, { ...ready, within_ms: LOADED_WITHIN_MS });
    if (!soon && !(await untilMode(store, { ...ready, within_ms: HELD_WITHIN_MS, released }))) return;
    // A user who still holds the button acts on the state that is shown now.
    await api.approach(released.aborted ? seen : store.seen());
    if (kind === "baseline" && (await isHeldAtStart(store, run.id, released))) await api.play(store.seen());
  };
  return (
    <CommandButton
      held
      command="load"
      disabled={!can}
      send={measure}
      {...(kind === "baseline" && { hint: t("endFeel:holdOn") })}
    >
      {t(`endFeel:measure.${kind}`)}
    </CommandButton>
  );
}
