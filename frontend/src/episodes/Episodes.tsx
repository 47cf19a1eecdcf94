import { Badge, Button, Card, Group, Modal, Stack, Text, Textarea, Title } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { useMay } from "../access/hooks";
import { api, type Episode, type Patient } from "../api/client";
import { ReportLinks } from "../reports/ReportLinks";
import { formatDay, formatMoment, sideWord } from "../shared/format";
import { ProblemNote } from "../shared/problem";
import { EpisodeForm } from "./EpisodeForm";
import { Stages } from "./Stages";
import { limitWords, STAGES } from "./words";

/** The care of this patient's shoulders: what goes on, and what was. */
export function Episodes({ patient }: { patient: Patient }) {
  const writes = useMay("write_records");
  const queries = useQueryClient();
  const [opening, setOpening] = useState<Episode["side"] | null>(null);
  const key = ["episodes", patient.id];
  const episodes = useQuery({ queryKey: key, queryFn: () => api.episodes(patient.id) });
  const saved = () => {
    setOpening(null);
    void queries.invalidateQueries({ queryKey: key });
    // Which shoulder is treated stands in the patient's record.
    void queries.invalidateQueries({ queryKey: ["patient", patient.id] });
    void queries.invalidateQueries({ queryKey: ["patients"] });
  };
  const items = episodes.data?.items ?? [];
  const goingOn = items.filter((one) => !one.closed_at);
  const past = items.filter((one) => one.closed_at);
  const free = (["left", "right"] as const).filter((side) => !goingOn.some((one) => one.side === side));
  return (
    <Stack gap="xs">
      <Group justify="space-between">
        <Title order={2} size="h3">
          Care
        </Title>
        {writes && episodes.data && !patient.archived_at && (
          <Group>
            {free.map((side) => (
              <Button key={side} variant="default" onClick={() => setOpening(side)}>
                Open an episode of the {side} shoulder
              </Button>
            ))}
          </Group>
        )}
      </Group>
      <ProblemNote error={episodes.error} />
      {episodes.data && goingOn.length === 0 && (
        <Text>No episode of care is open: nothing can be played to this patient until one is.</Text>
      )}
      {goingOn.map((one) => (
        <EpisodeCard key={one.id} episode={one} onSaved={saved} />
      ))}
      {past.length > 0 && (
        <Title order={3} size="h4">
          Past episodes
        </Title>
      )}
      {past.map((one) => (
        <EpisodeCard key={one.id} episode={one} onSaved={saved} archived={patient.archived_at !== null} />
      ))}
      <Modal
        opened={opening !== null}
        onClose={() => setOpening(null)}
        title={`New episode of the ${opening ?? "left"} shoulder`}
        size="xl"
      >
        {opening && <EpisodeForm patientId={patient.id} side={opening} onDone={saved} />}
      </Modal>
    </Stack>
  );
}

/** One episode, and what can be done with it. */
export function EpisodeCard(props: { episode: Episode; archived?: boolean; onSaved: () => void }) {
  const { episode, onSaved } = props;
  const writes = useMay("write_records");
  const [doing, setDoing] = useState<"edit" | "close" | null>(null);
  const reopen = useMutation({ mutationFn: () => api.reopenEpisode(episode.id), onSuccess: onSaved });
  const done = () => {
    setDoing(null);
    onSaved();
  };
  const { stage } = episode;
  const name = `${sideWord(episode.side)} shoulder`;
  return (
    <Card withBorder component="section" aria-label={`Episode of the ${episode.side} shoulder`}>
      <Stack gap="xs">
        <Group justify="space-between">
          <Group gap="sm">
            <Text size="lg" fw={600}>
              {name}
              {episode.diagnosis && `: ${episode.diagnosis}`}
            </Text>
            {episode.closed_at && <Badge color="gray">Closed</Badge>}
          </Group>
          {episode.closed_at
            ? writes &&
              !props.archived && (
                <Button variant="default" loading={reopen.isPending} onClick={() => reopen.mutate()}>
                  Reopen
                </Button>
              )
            : writes && (
                <Group>
                  <Button variant="default" onClick={() => setDoing("edit")}>
                    Change
                  </Button>
                  <Button variant="default" onClick={() => setDoing("close")}>
                    Close episode
                  </Button>
                </Group>
              )}
        </Group>
        <Group gap="lg">
          <Text>{stage ? `${STAGES[stage.stage]} since ${formatDay(stage.since)}` : "No stage noted"}</Text>
          {episode.onset_on && <Text>Onset {formatDay(episode.onset_on)}</Text>}
          <Text>
            Opened {formatMoment(episode.opened_at)}
            {episode.closed_at && `, closed ${formatMoment(episode.closed_at)}`}
          </Text>
        </Group>
        {episode.contraindications && (
          <Text style={{ whiteSpace: "pre-wrap" }}>Contraindications: {episode.contraindications}</Text>
        )}
        {episode.limits_by && (
          <div data-testid="limits">
            <Text fw={500}>Allowed by {episode.limits_by}</Text>
            {episode.limits.map((limit) => (
              <Text key={limit.motion}>{limitWords(limit)}</Text>
            ))}
            {episode.max_load_level !== null && (
              <Text>Resistance level {episode.max_load_level} at most</Text>
            )}
          </div>
        )}
        {episode.closing_note && (
          <Text style={{ whiteSpace: "pre-wrap" }}>Closing note: {episode.closing_note}</Text>
        )}
        <Stages episode={episode} onSaved={onSaved} />
        <ReportLinks of="episodes" id={episode.id} />
        <ProblemNote error={reopen.error} />
      </Stack>
      <Modal opened={doing === "edit"} onClose={() => setDoing(null)} title={name} size="xl">
        <EpisodeForm patientId={episode.patient_id} side={episode.side} episode={episode} onDone={done} />
      </Modal>
      <Modal opened={doing === "close"} onClose={() => setDoing(null)} title={`Close: ${name}`}>
        <CloseForm episode={episode} onDone={done} />
      </Modal>
    </Card>
  );
}

function CloseForm({ episode, onDone }: { episode: Episode; onDone: () => void }) {
  const [note, setNote] = useState(episode.closing_note);
  const close = useMutation({
    mutationFn: () => api.closeEpisode(episode.id, { closing_note: note, updated_at: episode.updated_at }),
    onSuccess: onDone,
  });
  return (
    <Stack>
      <Text>Nothing is played to this shoulder afterwards, until an episode of it is open again.</Text>
      <Textarea
        label="Closing note"
        autosize
        minRows={3}
        value={note}
        onChange={(event) => setNote(event.currentTarget.value)}
      />
      <ProblemNote error={close.error} />
      <Group justify="end">
        <Button loading={close.isPending} onClick={() => close.mutate()}>
          Close episode
        </Button>
      </Group>
    </Stack>
  );
}
