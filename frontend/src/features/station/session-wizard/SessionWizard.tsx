import { Button, Card, Group, Stack, Text, Title, UnstyledButton } from "@mantine/core";
import { IconCircleCheckFilled } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { useEffect, useRef, useState } from "react";
import { api, type Session } from "../../../lib/api/client";
import { t } from "../../../lib/i18n";
import { useLive } from "../../../lib/live/hooks";
import { useNewestSession, useRecordings } from "../../../lib/patientQueries";
import { useSetSessionCache } from "../../../lib/useSetSessionCache";
import { PageLink } from "../../../ui/links";
import { ProblemNote } from "../../../ui/ProblemNote";
import { NoteCard } from "../../sessions/NoteCard";
import { PlayPanel } from "../PlayPanel";
import { BeginStep } from "./BeginStep";
import { NrsScale } from "./NrsScale";
import { PreflightChecklist, useChecklist } from "./PreflightChecklist";
import { canGoTo, nextItem, STEPS, type Step, stepAfter, stepOf } from "./steps";
import classes from "./sessionWizard.module.css";

/**
 * A session, step by step. The service knows the current step, and going back is always possible. A press
 * that completes a step opens the next one; detections by the apparatus do not.
 */
export function SessionWizard({ patientId, wanted }: { patientId: string; wanted: string | null }) {
  const run = useLive("run");
  // The patient's current session: the newest one, unless it is signed and ended.
  const visit = useNewestSession(patientId);
  const [gone, setGone] = useState<Step | null>(null);
  const [another, setAnother] = useState(false);
  const newest = visit.data ?? null;
  const session = newest && (newest.signed_at || (another && newest.ended_at)) ? null : newest;
  // A running playback takes precedence.
  const step = run ? "play" : gone && canGoTo(gone, session) ? gone : stepOf(session);
  const heading = useRef<HTMLHeadingElement>(null);
  const asked = useRef(false);
  const go = (to: Step) => {
    asked.current = true;
    setGone(to);
  };
  const known = !visit.isPending;
  // The step stays as first shown: answers on it must not replace the step under the user's hand.
  useEffect(() => {
    if (known && gone === null) setGone(stepOf(session));
  }, [known, gone, session]);
  // The pressed button disappears with its step, so keyboard and screen-reader focus moves to the next
  // heading.
  useEffect(() => {
    if (asked.current && step === gone) {
      asked.current = false;
      heading.current?.focus();
    }
  }, [step, gone]);
  if (visit.isPending) return null;
  return (
    <Card withBorder component="section" aria-label={t("station:wizard.title")}>
      <Stack>
        <Steps step={step} session={session} locked={run !== null} onGo={go} />
        <Title order={2} size="h3" ref={heading} tabIndex={-1}>
          {t(`station:stepNames.${step}`)}
        </Title>
        <ProblemNote error={visit.error} />
        {step === "begin" && (
          <>
            {newest?.signed_at && (
              <Text>
                {t("station:wizard.lastSigned")}
                <PageLink to="/sessions/$sessionId" params={{ sessionId: newest.id }}>
                  {t("station:wizard.viewSession")}
                </PageLink>
              </Text>
            )}
            <BeginStep patientId={patientId} session={session} onDone={() => setGone(null)} />
          </>
        )}
        {step === "checklist" && session && <Checks session={session} onDone={() => go("pain_before")} />}
        {(step === "pain_before" || step === "pain_after") && session && (
          <Pain session={session} when={step} onDone={() => go(stepAfter(step))} />
        )}
        {step === "play" && (
          <>
            <PlayPanel patientId={patientId} session={session} wanted={wanted} />
            {!run && session && (
              <Group>
                <Button
                  size="lg"
                  variant={session.runs.length > 0 ? "filled" : "default"}
                  onClick={() => go("pain_after")}
                >
                  {t("station:wizard.finishPlaying")}
                </Button>
              </Group>
            )}
          </>
        )}
        {step === "note" && session && (
          <>
            <NoteCard key={session.id} session={session} />
            {session.ended_at && (
              <Group>
                <Button variant="default" size="lg" onClick={() => setAnother(true)}>
                  {t("station:wizard.signLater")}
                </Button>
              </Group>
            )}
          </>
        )}
      </Stack>
    </Card>
  );
}

function Steps(props: { step: Step; session: Session | null; locked: boolean; onGo: (step: Step) => void }) {
  const { step, session, locked, onGo } = props;
  const reached = STEPS.indexOf(stepOf(session));
  return (
    <Group component="nav" gap="xs" aria-label={t("station:wizard.steps")}>
      {STEPS.map((one, place) => (
        <UnstyledButton
          key={one}
          className={classes.step ?? ""}
          aria-current={one === step ? "step" : undefined}
          disabled={locked || !canGoTo(one, session)}
          onClick={() => onGo(one)}
        >
          {place < reached ? (
            <IconCircleCheckFilled size={22} aria-label={t("station:wizard.done")} />
          ) : (
            <b>{place + 1}</b>
          )}{" "}
          {t(`station:stepNames.${one}`)}
        </UnstyledButton>
      ))}
    </Group>
  );
}

/** Checks for the next recording of the programme, or for the patient's first recording. */
function Checks({ session, onDone }: { session: Session; onDone: () => void }) {
  const recordings = useRecordings(session.patient.id);
  const item = nextItem(session.programme?.items ?? [], session.runs);
  const first = (recordings.data?.items ?? []).find((one) => !one.archived_at);
  const recordingId = item?.recording_id ?? first?.id ?? null;
  const name = item?.recording_name ?? first?.name;
  const checklist = useChecklist(session.id, recordingId);
  const complete = checklist.data?.complete === true;
  return (
    <>
      <Text>
        {name ? t("station:wizard.checksFor", { recording: name }) : t("station:wizard.nothingTaught")}
      </Text>
      <PreflightChecklist sessionId={session.id} recordingId={recordingId} onComplete={onDone} />
      <Group>
        <Button size="xl" variant={complete ? "filled" : "default"} onClick={onDone}>
          {complete ? t("station:wizard.toPain") : t("station:wizard.skipToPain")}
        </Button>
      </Group>
    </>
  );
}

function Pain(props: { session: Session; when: "pain_before" | "pain_after"; onDone: () => void }) {
  const { session, when, onDone } = props;
  const keep = useSetSessionCache();
  const say = useMutation({
    mutationFn: (pain: Partial<Pick<Session, "pain_before" | "pain_during" | "pain_after">>) =>
      api.updateSession(session.id, { ...pain, updated_at: session.updated_at }),
    onSuccess: (saved) => {
      keep(saved);
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
          disabled={say.isPending}
          onChange={(pain_during) => say.mutate({ pain_during })}
        />
      )}
      <NrsScale
        label={when === "pain_before" ? t("station:wizard.painBefore") : t("station:wizard.painAfter")}
        value={session[when]}
        disabled={say.isPending}
        onChange={(pain) => say.mutate({ [when]: pain })}
      />
      <ProblemNote error={say.error} />
      <Group>
        <Button size="xl" variant={session[when] === null ? "default" : "filled"} onClick={onDone}>
          {session[when] === null ? t("station:wizard.skipPain") : t("station:wizard.continue")}
        </Button>
      </Group>
    </>
  );
}
