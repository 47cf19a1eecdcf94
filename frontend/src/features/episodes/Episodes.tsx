import { Badge, Button, Card, Group, Modal, Stack, Text, Textarea, Title } from "@mantine/core";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { api, type Episode, type Patient } from "../../lib/api/client";
import { formatDay, formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useEpisodes } from "../../lib/patientQueries";
import { ProblemNote } from "../../ui/ProblemNote";
import { useHasPermission } from "../auth/hooks";
import { ReportLinks } from "../reports/ReportLinks";
import { DoctorsLimits } from "./DoctorsLimits";
import { EpisodeForm } from "./EpisodeForm";
import { describeDiagnosis } from "./messages";
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
    // Fetched again, because the patient's record contains the treated side.
    void queries.invalidateQueries({ queryKey: ["patient", patient.id] });
    void queries.invalidateQueries({ queryKey: ["patients"] });
  };
  const items = episodes.data?.items ?? [];
  const open = items.filter((episode) => !episode.closed_at);
  const past = items.filter((episode) => episode.closed_at);
  const withoutOpen = (["left", "right"] as const).filter(
    (side) => !open.some((episode) => episode.side === side),
  );
  return (
    <Stack gap="xs">
      <Group justify="space-between">
        <Title order={2} size="h3">
          {t("episodes:care.title")}
        </Title>
        {writes && episodes.data && !patient.archived_at && (
          <Group>
            {withoutOpen.map((side) => (
              <Button key={side} variant="default" onClick={() => setOpening(side)}>
                {t(`episodes:care.open.${side}`)}
              </Button>
            ))}
          </Group>
        )}
      </Group>
      <ProblemNote error={episodes.error} />
      {episodes.data && open.length === 0 && <Text>{t("episodes:care.none")}</Text>}
      {open.map((episode) => (
        <EpisodeCard key={episode.id} episode={episode} onSaved={saved} />
      ))}
      {past.length > 0 && (
        <Title order={3} size="h4">
          {t("episodes:care.past")}
        </Title>
      )}
      {past.map((episode) => (
        <EpisodeCard
          key={episode.id}
          episode={episode}
          onSaved={saved}
          archived={patient.archived_at !== null}
        />
      ))}
      <Modal
        opened={opening !== null}
        onClose={() => setOpening(null)}
        title={t(`episodes:care.opening.${opening ?? "left"}`)}
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
  const [dialog, setDialog] = useState<"edit" | "close" | null>(null);
  const reopen = useMutation({ mutationFn: () => api.reopenEpisode(episode.id), onSuccess: onSaved });
  const done = () => {
    setDialog(null);
    onSaved();
  };
  const { stage } = episode;
  const name = t(`episodes:care.shoulder.${episode.side}`);
  return (
    <Card withBorder component="section" aria-label={t(`episodes:care.episode.${episode.side}`)}>
      <Stack gap="xs">
        <Group justify="space-between">
          <Group gap="sm">
            <Text size="lg" fw={600}>
              {describeDiagnosis(episode)
                ? t("episodes:care.diagnosed", { shoulder: name, diagnosis: describeDiagnosis(episode) })
                : name}
            </Text>
            {episode.closed_at && <Badge color="gray">{t("episodes:care.closed")}</Badge>}
          </Group>
          {writes && (
            <EpisodeActions
              episode={episode}
              archived={props.archived ?? false}
              reopening={reopen.isPending}
              onReopen={() => reopen.mutate()}
              onDialog={setDialog}
            />
          )}
        </Group>
        <Group gap="lg">
          <Text>
            {stage
              ? t(`episodes:stageList.since.${stage.stage}`, { day: formatDay(stage.since) })
              : t("episodes:care.noStage")}
          </Text>
          {episode.onset_on && <Text>{t("episodes:care.onset", { day: formatDay(episode.onset_on) })}</Text>}
          <Text>
            {episode.closed_at
              ? t("episodes:care.fromTo", {
                  opened: formatMoment(episode.opened_at),
                  closed: formatMoment(episode.closed_at),
                })
              : t("episodes:care.since", { opened: formatMoment(episode.opened_at) })}
          </Text>
        </Group>
        {episode.contraindications && (
          <Text style={{ whiteSpace: "pre-wrap" }}>
            {t("episodes:care.contraindications", { contraindications: episode.contraindications })}
          </Text>
        )}
        <DoctorsLimits episode={episode} />
        {episode.closing_note && (
          <Text style={{ whiteSpace: "pre-wrap" }}>
            {t("episodes:care.closingNote", { note: episode.closing_note })}
          </Text>
        )}
        <Stages episode={episode} onSaved={onSaved} />
        <ReportLinks of="episodes" id={episode.id} />
        <ProblemNote error={reopen.error} />
      </Stack>
      <Modal opened={dialog === "edit"} onClose={() => setDialog(null)} title={name} size="xl">
        <EpisodeForm patientId={episode.patient_id} side={episode.side} episode={episode} onDone={done} />
      </Modal>
      <Modal
        opened={dialog === "close"}
        onClose={() => setDialog(null)}
        title={t("episodes:care.closing", { shoulder: name })}
      >
        <CloseForm episode={episode} onDone={done} />
      </Modal>
    </Card>
  );
}

function EpisodeActions(props: {
  episode: Episode;
  archived: boolean;
  reopening: boolean;
  onReopen: () => void;
  onDialog: (dialog: "edit" | "close") => void;
}) {
  if (props.episode.closed_at)
    return props.archived ? null : (
      <Button variant="default" loading={props.reopening} onClick={props.onReopen}>
        {t("episodes:care.reopen")}
      </Button>
    );
  return (
    <Group>
      <Button variant="default" onClick={() => props.onDialog("edit")}>
        {t("episodes:care.change")}
      </Button>
      <Button variant="default" onClick={() => props.onDialog("close")}>
        {t("episodes:care.close")}
      </Button>
    </Group>
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
      <Text>{t("episodes:care.closingHint")}</Text>
      <Textarea
        label={t("episodes:care.closingNoteLabel")}
        autosize
        minRows={3}
        value={note}
        onChange={(event) => setNote(event.currentTarget.value)}
      />
      <ProblemNote error={close.error} />
      <Group justify="end">
        <Button loading={close.isPending} onClick={() => close.mutate()}>
          {t("episodes:care.close")}
        </Button>
      </Group>
    </Stack>
  );
}
