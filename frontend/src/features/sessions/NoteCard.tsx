import { Alert, Button, Card, Group, Loader, Select, Stack, Text, Textarea, Title } from "@mantine/core";
import { useDebouncedCallback } from "@mantine/hooks";
import { useMutation, useQuery } from "@tanstack/react-query";
import { useEffect, useRef, useState } from "react";
import { api, type Session } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useLive } from "../../lib/live/hooks";
import { isDatabaseUnavailable } from "../../lib/offline";
import { usePaperLanguage } from "../../lib/paperLanguage";
import { useSetSessionCache } from "../../lib/useSetSessionCache";
import { ProblemNote } from "../../ui/ProblemNote";
import { useHasPermission, useUserName } from "../auth/hooks";

const SAVE_AFTER_MS = 800;

/**
 * The session's note. It is drafted from the measurements, edited with autosave, and signed. After that it can
 * only get addenda.
 */
export function NoteCard({ session }: { session: Session }) {
  const writes = useHasPermission("write_records");
  return (
    <Card withBorder padding="lg" component="section" aria-label={t("sessions:note.title")}>
      <Stack>
        <Title order={2} size="h3">
          {t("sessions:note.title")}
        </Title>
        {session.signed_at ? (
          <SignedNote session={session} />
        ) : writes ? (
          <NoteEditor session={session} />
        ) : (
          <Text style={{ whiteSpace: "pre-wrap" }}>{session.note || t("sessions:note.empty")}</Text>
        )}
      </Stack>
    </Card>
  );
}

/** Save the note while the user types. `saveNow` saves the latest text and returns the session. */
function useNoteSaving(session: Session) {
  const setSessionCache = useSetSessionCache();
  // Saves run one after the other, each with the version of the previous answer.
  const version = useRef(session.updated_at);
  useEffect(() => {
    version.current = session.updated_at;
  }, [session.updated_at]);
  const save = useMutation({
    scope: { id: `note ${session.id}` },
    mutationFn: (note: string) => api.updateSession(session.id, { note, updated_at: version.current }),
    onSuccess: (saved) => {
      version.current = saved.updated_at;
      setSessionCache(saved);
    },
  });
  const saveLater = useDebouncedCallback((note: string) => save.mutate(note), {
    delay: SAVE_AFTER_MS,
    flushOnUnmount: true,
  });
  // Closing or hiding the page saves the latest input.
  useEffect(() => {
    window.addEventListener("pagehide", saveLater.flush);
    return () => window.removeEventListener("pagehide", saveLater.flush);
  }, [saveLater]);
  const saveNow = async (text: string) => {
    saveLater.cancel();
    return text === session.note ? session : await save.mutateAsync(text);
  };
  return { save, saveLater, saveNow };
}

function NoteEditor({ session }: { session: Session }) {
  const [language] = usePaperLanguage();
  const draft = useQuery({
    queryKey: ["session", session.id, "draft", language],
    queryFn: () => api.draft(session.id, language),
  });
  const [typed, setTyped] = useState<string | null>(null);
  const text = typed ?? (session.note || (draft.data?.text ?? ""));
  // The field takes no text that the draft would replace. After a failed attempt it does not wait any longer.
  const drafting = typed === null && !session.note && draft.isPending && draft.failureCount === 0;
  const saving = useNoteSaving(session);
  const change = (changed: string) => {
    setTyped(changed);
    saving.saveLater(changed);
  };
  const last = { session, text, saving, error: draft.error ?? saving.save.error };
  return (
    <>
      <Textarea
        label={t("sessions:note.label")}
        autosize
        minRows={4}
        value={text}
        readOnly={drafting}
        aria-busy={drafting}
        onChange={(event) => change(event.currentTarget.value)}
      />
      <Group>
        {drafting && <Loader size="xs" />}
        <Text size="sm" role="status">
          {drafting
            ? t("sessions:note.drafting")
            : typed === null && !session.note
              ? draft.data && t("sessions:note.drafted")
              : text === session.note
                ? t("sessions:note.saved")
                : t("sessions:note.notSaved")}
        </Text>
        {draft.data && text !== draft.data.text && (
          <Button variant="subtle" onClick={() => change(draft.data.text)}>
            {t("sessions:note.draftAgain")}
          </Button>
        )}
      </Group>
      {session.ended_at ? (
        <SignNote {...last} />
      ) : (
        <EndSession {...last} drafted={!draft.isPending} proposed={draft.data?.end_reason ?? null} />
      )}
    </>
  );
}

type EndReason = NonNullable<Session["end_reason"]>;

type LastStepProps = {
  session: Session;
  text: string;
  saving: ReturnType<typeof useNoteSaving>;
  /** An error of drafting or saving, which is shown before this step's own error. */
  error: Error | null;
};

/** Saves the text and signs the note. */
function SignNote({ session, text, saving, error }: LastStepProps) {
  const who = useUserName();
  const setSessionCache = useSetSessionCache();
  // Until the offline records have reached the database, the draft may lack runs.
  const arriving = (useLive("database")?.waiting ?? 0) > 0;
  const sign = useMutation({
    mutationFn: async () => {
      const { updated_at } = await saving.saveNow(text);
      return api.signSession(session.id, { signed_by: who, note: text, updated_at });
    },
    onSuccess: setSessionCache,
  });
  return (
    <>
      <Group align="center">
        <Button
          size="xl"
          disabled={!text || saving.save.isPending || arriving}
          loading={sign.isPending}
          onClick={() => sign.mutate()}
        >
          {t("sessions:note.signAs", { who })}
        </Button>
        <Text>{arriving ? t("sessions:note.stillSaving") : t("sessions:note.signedIsFinal")}</Text>
      </Group>
      <ProblemNote error={error ?? sign.error} />
    </>
  );
}

type EndProps = LastStepProps & { drafted: boolean; proposed: EndReason | null };

/** Saves the text and ends the session with a reason. */
function EndSession({ session, text, saving, error, drafted, proposed }: EndProps) {
  const setSessionCache = useSetSessionCache();
  const [reason, setReason] = useState<EndReason | null>(session.end_reason);
  const chosen = reason ?? proposed;
  const end = useMutation({
    mutationFn: async () => {
      try {
        await saving.saveNow(text);
      } catch (error) {
        // The note waits in its field until the database returns, but the session ends now.
        if (!isDatabaseUnavailable(error)) throw error;
      }
      return api.endSession(session.id, { reason: chosen });
    },
    onSuccess: setSessionCache,
  });
  return (
    <>
      <Group align="end">
        <Select
          size="lg"
          label={t("sessions:note.endReason")}
          allowDeselect={false}
          data={Object.entries(t("sessions:endReasons", { returnObjects: true })).map(([value, label]) => ({
            value,
            label,
          }))}
          value={chosen}
          onChange={(value) => setReason(value as EndReason | null)}
        />
        <Button
          size="xl"
          disabled={saving.save.isPending || !drafted}
          loading={end.isPending}
          onClick={() => end.mutate()}
        >
          {t("sessions:note.end")}
        </Button>
      </Group>
      <ProblemNote error={error ?? end.error} />
    </>
  );
}

function SignedNote({ session }: { session: Session }) {
  const writes = useHasPermission("write_records");
  return (
    <>
      <Text style={{ whiteSpace: "pre-wrap" }} data-testid="note">
        {session.note}
      </Text>
      <Text fw={600} data-testid="signed">
        {session.signed_at &&
          t("sessions:note.signedBy", { who: session.signed_by, when: formatMoment(session.signed_at) })}
      </Text>
      {session.addenda.map((addendum) => (
        <Alert
          key={addendum.id}
          variant="outline"
          color="gray"
          title={t("sessions:note.addendumBy", {
            who: addendum.written_by,
            when: formatMoment(addendum.written_at),
          })}
        >
          <Text style={{ whiteSpace: "pre-wrap" }}>{addendum.text}</Text>
        </Alert>
      ))}
      {writes && <Add session={session} />}
    </>
  );
}

function Add({ session }: { session: Session }) {
  const who = useUserName();
  const setSessionCache = useSetSessionCache();
  const [text, setText] = useState("");
  const add = useMutation({
    mutationFn: () => api.addAddendum(session.id, { written_by: who, text }),
    onSuccess: (saved) => {
      setText("");
      setSessionCache(saved);
    },
  });
  return (
    <>
      <Textarea
        label={t("sessions:note.addendum")}
        description={t("sessions:note.addendumExplanation")}
        autosize
        minRows={2}
        value={text}
        onChange={(event) => setText(event.currentTarget.value)}
      />
      <Group>
        <Button
          variant="default"
          size="lg"
          disabled={text.trim() === ""}
          loading={add.isPending}
          onClick={() => add.mutate()}
        >
          {t("sessions:note.addAs", { who })}
        </Button>
      </Group>
      <ProblemNote error={add.error} />
    </>
  );
}
