import { Alert, Button, Card, Group, Select, Stack, Text, Textarea, Title } from "@mantine/core";
import { useDebouncedCallback } from "@mantine/hooks";
import { useMutation, useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { useMay, useName } from "../access/hooks";
import { api, type Schemas, type Session } from "../api/client";
import { formatMoment } from "./format";
import { useKeepSession } from "./keepSession";
import { usePaperLanguage } from "./paperLanguage";
import { ProblemNote } from "./problem";

const SAVE_AFTER_MS = 800;

export const END_REASONS: Record<NonNullable<Session["end_reason"]>, string> = {
  completed: "Completed as planned",
  shortened: "Shortened by the therapist",
  stopped: "Ended by a stop",
  patient_request: "At the patient's request",
  other: "Other",
};

/** The note: drafted from what was measured, edited, signed, and then only added to. What is typed is saved by itself. */
export function NoteCard({ session }: { session: Session }) {
  const writes = useMay("write_records");
  return (
    <Card withBorder padding="lg" component="section" aria-label="Note">
      <Stack>
        <Title order={2} size="h3">
          Note
        </Title>
        {session.signed_at ? (
          <Signed session={session} />
        ) : writes ? (
          <Open session={session} />
        ) : (
          <Text style={{ whiteSpace: "pre-wrap" }}>{session.note || "Nothing is written yet."}</Text>
        )}
      </Stack>
    </Card>
  );
}

function Open({ session }: { session: Session }) {
  const who = useName();
  const keep = useKeepSession();
  const [language] = usePaperLanguage();
  const draft = useQuery({
    queryKey: ["session", session.id, "draft", language],
    queryFn: () => api.draft(session.id, language),
  });
  const [typed, setTyped] = useState<string | null>(null);
  const [reason, setReason] = useState<Schemas["SessionEnd"]["reason"]>(session.end_reason);
  const text = typed ?? (session.note || (draft.data?.text ?? ""));
  const chosen = reason ?? draft.data?.end_reason ?? null;
  const save = useMutation({
    mutationFn: (note: string) => api.updateSession(session.id, { note, updated_at: session.updated_at }),
    onSuccess: keep,
  });
  const later = useDebouncedCallback((note: string) => save.mutate(note), SAVE_AFTER_MS);
  const saved = async () => {
    later.cancel();
    return text === session.note ? session : await save.mutateAsync(text);
  };
  const end = useMutation({
    mutationFn: async () => {
      await saved();
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
        label="Note of this session"
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
            ? "Drafted from what was measured. Read it, and change what is not so."
            : text === session.note
              ? "Saved"
              : "Not saved yet"}
        </Text>
        {draft.data && text !== draft.data.text && (
          <Button
            variant="subtle"
            onClick={() => {
              setTyped(draft.data.text);
              later(draft.data.text);
            }}
          >
            Draft it anew
          </Button>
        )}
      </Group>
      {session.ended_at ? (
        <Group align="center">
          <Button
            size="xl"
            disabled={!text || save.isPending}
            loading={sign.isPending}
            onClick={() => sign.mutate()}
          >
            Sign as {who}
          </Button>
          <Text>Once signed, the note stays as it is.</Text>
        </Group>
      ) : (
        <Group align="end">
          <Select
            size="lg"
            label="How did it end?"
            allowDeselect={false}
            data={Object.entries(END_REASONS).map(([value, label]) => ({ value, label }))}
            value={chosen}
            onChange={(value) => setReason(value as typeof reason)}
          />
          <Button
            size="xl"
            disabled={save.isPending || draft.isPending}
            loading={end.isPending}
            onClick={() => end.mutate()}
          >
            End the session
          </Button>
        </Group>
      )}
      <ProblemNote error={draft.error ?? save.error ?? end.error ?? sign.error} />
    </>
  );
}

function Signed({ session }: { session: Session }) {
  const writes = useMay("write_records");
  return (
    <>
      <Text style={{ whiteSpace: "pre-wrap" }} data-testid="note">
        {session.note}
      </Text>
      <Text fw={600} data-testid="signed">
        Signed by {session.signed_by}, {session.signed_at && formatMoment(session.signed_at)}
      </Text>
      {session.addenda.map((one) => (
        <Alert
          key={one.id}
          variant="outline"
          color="gray"
          title={`Addendum by ${one.written_by}, ${formatMoment(one.written_at)}`}
        >
          <Text style={{ whiteSpace: "pre-wrap" }}>{one.text}</Text>
        </Alert>
      ))}
      {writes && <Add session={session} />}
    </>
  );
}

function Add({ session }: { session: Session }) {
  const who = useName();
  const keep = useKeepSession();
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
        label="Addendum"
        description="The signed note stays as it is; what is to be added stands below it."
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
          Add as {who}
        </Button>
      </Group>
      <ProblemNote error={add.error} />
    </>
  );
}
