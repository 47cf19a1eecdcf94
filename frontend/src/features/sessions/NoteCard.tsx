import { Alert, Button, Card, Group, Select, Stack, Text, Textarea, Title } from "@mantine/core";
import { useDebouncedCallback } from "@mantine/hooks";
import { useMutation, useQuery } from "@tanstack/react-query";
import { useEffect, useRef, useState } from "react";
import { api, type Schemas, type Session } from "../../lib/api/client";
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
 * The session's note: drafted from the measurements, edited with autosave, signed, then extended only by
 * addenda.
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
          <Signed session={session} />
        ) : writes ? (
          <Open session={session} />
        ) : (
          <Text style={{ whiteSpace: "pre-wrap" }}>{session.note || t("sessions:note.empty")}</Text>
        )}
      </Stack>
    </Card>
  );
}

function Open({ session }: { session: Session }) {
  const who = useUserName();
  const keep = useSetSessionCache();
  // Until the offline records arrive, the draft may miss runs.
  const arriving = (useLive("database")?.waiting ?? 0) > 0;
  const [language] = usePaperLanguage();
  const draft = useQuery({
    queryKey: ["session", session.id, "draft", language],
    queryFn: () => api.draft(session.id, language),
  });
  const [typed, setTyped] = useState<string | null>(null);
  const [reason, setReason] = useState<Schemas["SessionEnd"]["reason"]>(session.end_reason);
  const text = typed ?? (session.note || (draft.data?.text ?? ""));
  const chosen = reason ?? draft.data?.end_reason ?? null;
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
      keep(saved);
    },
  });
  const later = useDebouncedCallback((note: string) => save.mutate(note), {
    delay: SAVE_AFTER_MS,
    flushOnUnmount: true,
  });
  // Closing or hiding the page saves the latest input.
  useEffect(() => {
    window.addEventListener("pagehide", later.flush);
    return () => window.removeEventListener("pagehide", later.flush);
  }, [later]);
  const saved = async () => {
    later.cancel();
    return text === session.note ? session : await save.mutateAsync(text);
  };
  const end = useMutation({
    mutationFn: async () => {
      try {
        await saved();
      } catch (error) {
        // The note waits in its field for the database, but the session ends.
        if (!isDatabaseUnavailable(error)) throw error;
      }
      return api.endSession(session.id, { reason: chosen });
    },
    onSuccess: keep,
  });
  const sign = useMutation({
    mutationFn: async () => {
      const { updated_at } = await saved();
      return api.signSession(session.id, { signed_by: who, note: text, updated_at });
    },
    onSuccess: keep,
  });
  return (
    <>
      <Textarea
        label={t("sessions:note.label")}
        autosize
        minRows={4}
        value={text}
        onChange={(event) => {
          setTyped(event.currentTarget.value);
          later(event.currentTarget.value);
        }}
      />
      <Group>
        <Text size="sm" role="status">
          {typed === null && !session.note
            ? t("sessions:note.drafted")
            : text === session.note
              ? t("sessions:note.saved")
              : t("sessions:note.notSaved")}
        </Text>
        {draft.data && text !== draft.data.text && (
          <Button
            variant="subtle"
            onClick={() => {
              setTyped(draft.data.text);
              later(draft.data.text);
            }}
          >
            {t("sessions:note.draftAgain")}
          </Button>
        )}
      </Group>
      {session.ended_at ? (
        <Group align="center">
          <Button
            size="xl"
            disabled={!text || save.isPending || arriving}
            loading={sign.isPending}
            onClick={() => sign.mutate()}
          >
            {t("sessions:note.signAs", { who })}
          </Button>
          <Text>{arriving ? t("sessions:note.stillSaving") : t("sessions:note.signedIsFinal")}</Text>
        </Group>
      ) : (
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
            onChange={(value) => setReason(value as typeof reason)}
          />
          <Button
            size="xl"
            disabled={save.isPending || draft.isPending}
            loading={end.isPending}
            onClick={() => end.mutate()}
          >
            {t("sessions:note.end")}
          </Button>
        </Group>
      )}
      <ProblemNote error={draft.error ?? save.error ?? end.error ?? sign.error} />
    </>
  );
}

function Signed({ session }: { session: Session }) {
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
      {session.addenda.map((one) => (
        <Alert
          key={one.id}
          variant="outline"
          color="gray"
          title={t("sessions:note.addendumBy", { who: one.written_by, when: formatMoment(one.written_at) })}
        >
          <Text style={{ whiteSpace: "pre-wrap" }}>{one.text}</Text>
        </Alert>
      ))}
      {writes && <Add session={session} />}
    </>
  );
}

function Add({ session }: { session: Session }) {
  const who = useUserName();
  const keep = useSetSessionCache();
  const [text, setText] = useState("");
  const add = useMutation({
    mutationFn: () => api.addAddendum(session.id, { written_by: who, text }),
    onSuccess: (saved) => {
      setText("");
      keep(saved);
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
