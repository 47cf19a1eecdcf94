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
import { EpisodeForm } from "./EpisodeForm";
import { limitWords } from "./messages";
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
          {t("episodes:care.title")}
        </Title>
        {writes && episodes.data && !patient.archived_at && (
          <Group>
            {free.map((side) => (
              <Button key={side} variant="default" onClick={() => setOpening(side)}>
                {t(`episodes:care.open.${side}`)}
              </Button>
            ))}
          </Group>
        )}
      </Group>
      <ProblemNote error={episodes.error} />
      {episodes.data && goingOn.length === 0 && <Text>{t("episodes:care.none")}</Text>}
      {goingOn.map((one) => (
        <EpisodeCard key={one.id} episode={one} onSaved={saved} />
      ))}
      {past.length > 0 && (
        <Title order={3} size="h4">
          {t("episodes:care.past")}
        </Title>
      )}
      {past.map((one) => (
        <EpisodeCard key={one.id} episode={one} onSaved={saved} archived={patient.archived_at !== null} />
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
  const [doing, setDoing] = useState<"edit" | "close" | null>(null);
  const reopen = useMutation({ mutationFn: () => api.reopenEpisode(episode.id), onSuccess: onSaved });
  const done = () => {
    setDoing(null);
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
              {episode.diagnosis
                ? t("episodes:care.diagnosed", { shoulder: name, diagnosis: episode.diagnosis })
                : name}
            </Text>
            {episode.closed_at && <Badge color="gray">{t("episodes:care.closed")}</Badge>}
          </Group>
          {episode.closed_at
            ? writes &&
              !props.archived && (
                <Button variant="default" loading={reopen.isPending} onClick={() => reopen.mutate()}>
                  {t("episodes:care.reopen")}
                </Button>
              )
            : writes && (
                <Group>
                  <Button variant="default" onClick={() => setDoing("edit")}>
                    {t("episodes:care.change")}
                  </Button>
                  <Button variant="default" onClick={() => setDoing("close")}>
                    {t("episodes:care.close")}
                  </Button>
                </Group>
              )}
        </Group>
        <Group gap="lg">
          <Text>
            {stage
              ? t(`episodes:noted.since.${stage.stage}`, { day: formatDay(stage.since) })
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
        {episode.limits_by && (
          <div data-testid="limits">
            <Text fw={500}>{t("episodes:care.allowedBy", { doctor: episode.limits_by })}</Text>
            {episode.limits.map((limit) => (
              <Text key={limit.motion}>{limitWords(limit)}</Text>
            ))}
            {episode.max_load_level !== null && (
              <Text>{t("episodes:care.levelAtMost", { level: episode.max_load_level })}</Text>
            )}
            {episode.max_speed_deg_s !== null && (
              <Text>{t("episodes:care.speedAtMost", { degPerSecond: episode.max_speed_deg_s })}</Text>
            )}
          </div>
        )}
        {episode.closing_note && (
          <Text style={{ whiteSpace: "pre-wrap" }}>
            {t("episodes:care.closingNote", { note: episode.closing_note })}
          </Text>
        )}
        <Stages episode={episode} onSaved={onSaved} />
        <ReportLinks of="episodes" id={episode.id} />
        <ProblemNote error={reopen.error} />
      </Stack>
      <Modal opened={doing === "edit"} onClose={() => setDoing(null)} title={name} size="xl">
        <EpisodeForm patientId={episode.patient_id} side={episode.side} episode={episode} onDone={done} />
      </Modal>
      <Modal
        opened={doing === "close"}
        onClose={() => setDoing(null)}
        title={t("episodes:care.closing", { shoulder: name })}
      >
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
