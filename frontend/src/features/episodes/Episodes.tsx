import { Badge, Button, Card, Group, Modal, Stack, Text, Textarea, Title } from "@mantine/core";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { api, type Episode, type Patient } from "../../lib/api/client";
import { formatDay, formatMoment } from "../../lib/format";
import { useEpisodes } from "../../lib/patientQueries";
import { ProblemNote } from "../../ui/ProblemNote";
import { useHasPermission } from "../auth/hooks";
import { ReportLinks } from "../reports/ReportLinks";
import { EpisodeForm } from "./EpisodeForm";
import { CARE, limitWords, NOTED } from "./messages";
import { Stages } from "./Stages";

/** The patient's open and closed episodes of care. */
export function Episodes({ patient }: { patient: Patient }) {
  const writes = useHasPermission("write_records");
  const queries = useQueryClient();
  const [opening, setOpening] = useState<Episode["side"] | null>(null);
  const episodes = useEpisodes(patient.id);
  const saved = () => {
    setOpening(null);
    void queries.invalidateQueries({ queryKey: ["episodes", patient.id] });
    // The patient's record contains the treated side.
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
          {CARE.title}
        </Title>
        {writes && episodes.data && !patient.archived_at && (
          <Group>
            {free.map((side) => (
              <Button key={side} variant="default" onClick={() => setOpening(side)}>
                {CARE.open(side)}
              </Button>
            ))}
          </Group>
        )}
      </Group>
      <ProblemNote error={episodes.error} />
      {episodes.data && goingOn.length === 0 && <Text>{CARE.none}</Text>}
      {goingOn.map((one) => (
        <EpisodeCard key={one.id} episode={one} onSaved={saved} />
      ))}
      {past.length > 0 && (
        <Title order={3} size="h4">
          {CARE.past}
        </Title>
      )}
      {past.map((one) => (
        <EpisodeCard key={one.id} episode={one} onSaved={saved} archived={patient.archived_at !== null} />
      ))}
      <Modal
        opened={opening !== null}
        onClose={() => setOpening(null)}
        title={CARE.opening(opening ?? "left")}
        size="xl"
      >
        {opening && <EpisodeForm patientId={patient.id} side={opening} onDone={saved} />}
      </Modal>
    </Stack>
  );
}

/** One episode with its actions. */
export function EpisodeCard(props: { episode: Episode; archived?: boolean; onSaved: () => void }) {
  const { episode, onSaved } = props;
  const writes = useHasPermission("write_records");
  const [doing, setDoing] = useState<"edit" | "close" | null>(null);
  const reopen = useMutation({ mutationFn: () => api.reopenEpisode(episode.id), onSuccess: onSaved });
  const done = () => {
    setDoing(null);
    onSaved();
  };
  const { stage } = episode;
  const name = CARE.shoulder(episode.side);
  return (
    <Card withBorder component="section" aria-label={CARE.episode(episode.side)}>
      <Stack gap="xs">
        <Group justify="space-between">
          <Group gap="sm">
            <Text size="lg" fw={600}>
              {episode.diagnosis ? CARE.diagnosed(name, episode.diagnosis) : name}
            </Text>
            {episode.closed_at && <Badge color="gray">{CARE.closed}</Badge>}
          </Group>
          {episode.closed_at
            ? writes &&
              !props.archived && (
                <Button variant="default" loading={reopen.isPending} onClick={() => reopen.mutate()}>
                  {CARE.reopen}
                </Button>
              )
            : writes && (
                <Group>
                  <Button variant="default" onClick={() => setDoing("edit")}>
                    {CARE.change}
                  </Button>
                  <Button variant="default" onClick={() => setDoing("close")}>
                    {CARE.close}
                  </Button>
                </Group>
              )}
        </Group>
        <Group gap="lg">
          <Text>{stage ? NOTED.since(stage.stage, formatDay(stage.since)) : CARE.noStage}</Text>
          {episode.onset_on && <Text>{CARE.onset(formatDay(episode.onset_on))}</Text>}
          <Text>
            {episode.closed_at
              ? CARE.fromTo(formatMoment(episode.opened_at), formatMoment(episode.closed_at))
              : CARE.since(formatMoment(episode.opened_at))}
          </Text>
        </Group>
        {episode.contraindications && (
          <Text style={{ whiteSpace: "pre-wrap" }}>{CARE.contraindications(episode.contraindications)}</Text>
        )}
        {episode.limits_by && (
          <div data-testid="limits">
            <Text fw={500}>{CARE.allowedBy(episode.limits_by)}</Text>
            {episode.limits.map((limit) => (
              <Text key={limit.motion}>{limitWords(limit)}</Text>
            ))}
            {episode.max_load_level !== null && <Text>{CARE.levelAtMost(episode.max_load_level)}</Text>}
            {episode.max_speed_deg_s !== null && <Text>{CARE.speedAtMost(episode.max_speed_deg_s)}</Text>}
          </div>
        )}
        {episode.closing_note && (
          <Text style={{ whiteSpace: "pre-wrap" }}>{CARE.closingNote(episode.closing_note)}</Text>
        )}
        <Stages episode={episode} onSaved={onSaved} />
        <ReportLinks of="episodes" id={episode.id} />
        <ProblemNote error={reopen.error} />
      </Stack>
      <Modal opened={doing === "edit"} onClose={() => setDoing(null)} title={name} size="xl">
        <EpisodeForm patientId={episode.patient_id} side={episode.side} episode={episode} onDone={done} />
      </Modal>
      <Modal opened={doing === "close"} onClose={() => setDoing(null)} title={CARE.closing(name)}>
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
      <Text>{CARE.closingMeans}</Text>
      <Textarea
        label={CARE.closingNoteLabel}
        autosize
        minRows={3}
        value={note}
        onChange={(event) => setNote(event.currentTarget.value)}
      />
      <ProblemNote error={close.error} />
      <Group justify="end">
        <Button loading={close.isPending} onClick={() => close.mutate()}>
          {CARE.close}
        </Button>
      </Group>
    </Stack>
  );
}
