import { Button, Card, Group, Stack, Text, UnstyledButton } from "@mantine/core";
import { IconCircleCheckFilled } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { type RefObject, useEffect, useLayoutEffect, useRef, useState } from "react";
import { api, type Session } from "../../../lib/api/client";
import { t } from "../../../lib/i18n";
import { useLive } from "../../../lib/live/hooks";
import { useNewestSession, useRecordings } from "../../../lib/patientQueries";
import { useSetSessionCache } from "../../../lib/useSetSessionCache";
import type { HelpTopic } from "../../../ui/HelpLink";
import { PageLink } from "../../../ui/links";
import { ProblemNote } from "../../../ui/ProblemNote";
import { useRevealed } from "../../../ui/RevealWhenLoaded";
import { CARD_OF_STEP, StepActions } from "../../../ui/StepActions";
import { TitleWithHelp } from "../../../ui/TitleWithHelp";
import { NoteCard } from "../../sessions/NoteCard";
import { PlayPanel } from "../PlayPanel";
import { BeginStep } from "./BeginStep";
import { NrsScale } from "./NrsScale";
import { PreflightChecklist, useChecklist } from "./PreflightChecklist";
import classes from "./sessionWizard.module.css";
import { canGoTo, nextItem, STEPS, type Step, stepAfter, stepOf, stepsDone } from "./steps";

const HELP: Record<Step, HelpTopic> = {
  begin: "session",
  checklist: "before",
  pain_before: "pain",
  play: "playing",
  pain_after: "pain",
  note: "notes",
};

/**
 * A session, step by step. The record contains the current step, and the user can always go back. A press that
 * completes a step opens the next step; a detection by the apparatus does not.
 */
export function SessionWizard({ patientId, wanted }: { patientId: string; wanted: string | null }) {
  const run = useLive("run");
  // The patient's current session is the newest one, unless it has ended and is signed.
  const newestSession = useNewestSession(patientId);
  const [beginsAnother, setBeginsAnother] = useState(false);
  const newest = newestSession.data ?? null;
  const session = newest && (newest.signed_at || (beginsAnother && newest.ended_at)) ? null : newest;
  const { step, go, reset, heading } = useStep(session, !newestSession.isPending, run !== null);
  if (newestSession.isPending) return null;
  return (
    <Card
      withBorder
      padding="sm"
      component="section"
      className={`${CARD_OF_STEP} ${classes.wizard}`}
      aria-label={t("station:wizard.title")}
    >
      <Stack gap="sm">
        <Steps step={step} session={session} locked={run !== null} onGo={go} />
        <TitleWithHelp order={2} size="h4" ref={heading} tabIndex={-1} topic={HELP[step]}>
          {t(`station:stepNames.${step}`)}
        </TitleWithHelp>
        <ProblemNote error={newestSession.error} />
        {step === "begin" && (
          <>
            {newest?.signed_at && <LastSigned sessionId={newest.id} />}
            <BeginStep patientId={patientId} session={session} onDone={reset} />
          </>
        )}
        {step === "checklist" && session && (
          <ChecklistStep session={session} onDone={() => go("pain_before")} />
        )}
        {(step === "pain_before" || step === "pain_after") && session && (
          <PainStep session={session} when={step} onDone={() => go(stepAfter(step))} />
        )}
        {step === "play" && (
          <>
            <PlayPanel session={session} wanted={wanted} />
            {!run && session && <FinishPlaying session={session} onDone={() => go("pain_after")} />}
          </>
        )}
        {step === "note" && session && (
          <NoteStep session={session} onBeginAnother={() => setBeginsAnother(true)} />
        )}
      </Stack>
    </Card>
  );
}

/**
 * Return the shown step, the functions that change it, and the ref of its heading. `known`: the session is
 * loaded.
 */
function useStep(session: Session | null, known: boolean, playing: boolean) {
  const [openedStep, setOpenedStep] = useState<Step | null>(null);
  // A running playback takes precedence.
  const step = playing ? "play" : openedStep && canGoTo(openedStep, session) ? openedStep : stepOf(session);
  const heading = useRef<HTMLHeadingElement>(null);
  const focusHeading = useRef(false);
  const go = (to: Step) => {
    focusHeading.current = true;
    setOpenedStep(to);
  };
  // The step that was first shown stays, because answers must not replace the step that the user is using.
  useEffect(() => {
    if (known && openedStep === null) setOpenedStep(stepOf(session));
  }, [known, openedStep, session]);
  // The pressed button disappears with its step, so the focus of keyboard and screen reader moves to the next
  // heading. The steps move to the top of the screen, except while playing, when the live view stays visible.
  useEffect(() => {
    if (focusHeading.current && step === openedStep) {
      focusHeading.current = false;
      heading.current?.focus({ preventScroll: step !== "play" });
      if (step !== "play") scrollToSteps(heading.current);
    }
  }, [step, openedStep]);
  // Parts above the steps disappear when a motion is loaded, so on a scrolled page Pause would be above the screen.
  useLayoutEffect(() => {
    if (playing) scrollToSteps(heading.current, "nearest");
  }, [playing]);
  useScrollWhenRevealed(heading, known && step !== "begin" && step !== "play");
  return { step, go, reset: () => setOpenedStep(null), heading };
}

/**
 * Scroll to the steps when the page is revealed, as after a reload, if `needed`. A page that is already visible
 * does not move. The focus stays.
 */
function useScrollWhenRevealed(heading: RefObject<HTMLHeadingElement | null>, needed: boolean) {
  const revealed = useRevealed();
  const wasRevealed = useRef(false);
  useLayoutEffect(() => {
    if (!revealed || wasRevealed.current) return;
    wasRevealed.current = true;
    if (needed) scrollToSteps(heading.current);
  }, [revealed, needed, heading]);
}

/** Move the steps to the top of the screen; with "nearest", only as far as all of them are on the screen. */
const scrollToSteps = (heading: HTMLElement | null, block: "start" | "nearest" = "start") =>
  heading?.closest("section")?.scrollIntoView({ block });

function LastSigned({ sessionId }: { sessionId: string }) {
  return (
    <Text>
      {t("station:wizard.lastSigned")}
      <PageLink to="/sessions/$sessionId" params={{ sessionId }} search={{ tab: "record" }}>
        {t("station:wizard.viewSession")}
      </PageLink>
    </Text>
  );
}

function FinishPlaying({ session, onDone }: { session: Session; onDone: () => void }) {
  return (
    <Group>
      <Button size="lg" variant={session.runs.length > 0 ? "filled" : "default"} onClick={onDone}>
        {t("station:wizard.finishPlaying")}
      </Button>
    </Group>
  );
}

function NoteStep({ session, onBeginAnother }: { session: Session; onBeginAnother: () => void }) {
  return (
    <>
      <NoteCard key={session.id} session={session} />
      {session.ended_at && (
        <Group>
          <Button variant="default" size="lg" onClick={onBeginAnother}>
            {t("station:wizard.signLater")}
          </Button>
        </Group>
      )}
    </>
  );
}

function Steps(props: { step: Step; session: Session | null; locked: boolean; onGo: (step: Step) => void }) {
  const { step, session, locked, onGo } = props;
  const done = stepsDone(session, locked);
  return (
    <Group component="nav" gap={6} aria-label={t("station:wizard.steps")}>
      {STEPS.map((listed, place) => (
        <UnstyledButton
          key={listed}
          className={classes.step ?? ""}
          aria-current={listed === step ? "step" : undefined}
          disabled={locked || !canGoTo(listed, session)}
          onClick={() => onGo(listed)}
        >
          {place < done ? (
            <IconCircleCheckFilled size={22} aria-label={t("station:wizard.done")} />
          ) : (
            <b>{place + 1}</b>
          )}
          <span className={classes.stepName}>{t(`station:stepNames.${listed}`)}</span>
        </UnstyledButton>
      ))}
    </Group>
  );
}

/** Shows the checks for the next recording of the programme, or for the patient's first recording. */
function ChecklistStep({ session, onDone }: { session: Session; onDone: () => void }) {
  const recordings = useRecordings(session.patient.id);
  const item = nextItem(session.programme?.items ?? [], session.runs);
  const first = (recordings.data?.items ?? []).find((recording) => !recording.archived_at);
  const recordingId = item?.recording_id ?? first?.id ?? null;
  const name = item?.recording_name ?? first?.name;
  const checklist = useChecklist(session.id, recordingId);
  const complete = checklist.data?.complete === true;
  return (
    <>
      <Text>
        {name ? t("station:wizard.checksFor", { recording: name }) : t("station:wizard.nothingTaught")}
      </Text>
      <PreflightChecklist
        sessionId={session.id}
        recordingId={recordingId}
        onComplete={onDone}
        next={
          <Button size={complete ? "lg" : "md"} variant={complete ? "filled" : "subtle"} onClick={onDone}>
            {complete ? t("station:wizard.toPain") : t("station:wizard.skipToPain")}
          </Button>
        }
      />
    </>
  );
}

function PainStep(props: { session: Session; when: "pain_before" | "pain_after"; onDone: () => void }) {
  const { session, when, onDone } = props;
  const setSessionCache = useSetSessionCache();
  const savePain = useMutation({
    mutationFn: (pain: Partial<Pick<Session, "pain_before" | "pain_during" | "pain_after">>) =>
      api.updateSession(session.id, { ...pain, updated_at: session.updated_at }),
    onSuccess: (saved) => {
      setSessionCache(saved);
      const answered = when === "pain_before" || saved.pain_during !== null;
      if (answered && saved[when] !== null) onDone();
    },
  });
  return (
    <>
      {when === "pain_after" && (
        <NrsScale
          label={t("station:wizard.worstPain")}
          value={session.pain_during}
          disabled={savePain.isPending}
          onChange={(pain_during) => savePain.mutate({ pain_during })}
        />
      )}
      <NrsScale
        label={when === "pain_before" ? t("station:wizard.painBefore") : t("station:wizard.painAfter")}
        value={session[when]}
        disabled={savePain.isPending}
        onChange={(pain) => savePain.mutate({ [when]: pain })}
      />
      <ProblemNote error={savePain.error} />
      <StepActions>
        <Button size="xl" variant={session[when] === null ? "default" : "filled"} onClick={onDone}>
          {session[when] === null ? t("station:wizard.skipPain") : t("station:wizard.continue")}
        </Button>
      </StepActions>
    </>
  );
}
