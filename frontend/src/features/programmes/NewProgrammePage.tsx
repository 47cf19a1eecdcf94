import "./catalogue";
import { Radio, Stack, Text, TextInput, Title } from "@mantine/core";
import { useNavigate, useParams } from "@tanstack/react-router";
import { useState } from "react";
import { useTitle } from "../../app/title";
import { api, type Episode, type Programme } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { useEpisodes } from "../../lib/patientQueries";
import { ProblemNote } from "../../ui/ProblemNote";
import { describeDiagnosis } from "../episodes/messages";
import { PatientBanner } from "../patients/PatientBanner";
import { EMPTY, type Wanted } from "./draft";
import { ProgrammeEditor } from "./ProgrammeEditor";
import { useSetProgrammeCache } from "./useSetProgrammeCache";

/** Creates a programme. If both shoulders are treated, the user chooses the episode. */
export function NewProgrammePage() {
  const { patientId } = useParams({ from: "/patients/$patientId/programmes/new" });
  const navigate = useNavigate();
  const setProgrammeCache = useSetProgrammeCache();
  useTitle(t("programmes:new.title"));
  return (
    <Stack>
      <PatientBanner patientId={patientId} link />
      <Title order={1} size="h2">
        {t("programmes:new.title")}
      </Title>
      <NewProgramme
        patientId={patientId}
        onSaved={(made) => {
          setProgrammeCache(made);
          void navigate({ to: "/programmes/$programmeId", params: { programmeId: made.id } });
        }}
        onCancel={() => void navigate({ to: "/patients/$patientId", params: { patientId } })}
      />
    </Stack>
  );
}

/** The editor of a new programme for a known episode of care. */
export function NewProgramme(props: {
  patientId: string;
  onSaved: (made: Programme) => void;
  onCancel: () => void;
}) {
  const { patientId } = props;
  const [name, setName] = useState("");
  const [chosen, setChosen] = useState<string | null>(null);
  const episodes = useEpisodes(patientId);
  const open = (episodes.data?.items ?? []).filter(({ closed_at }) => !closed_at);
  const episode = open.length === 1 ? open[0] : open.find(({ id }) => id === chosen);
  const save = async (wanted: Wanted) =>
    props.onSaved(await api.createProgramme(patientId, { ...wanted, name, episode_id: episode?.id ?? null }));
  return (
    <>
      <ProblemNote error={episodes.error} />
      {episodes.data && open.length === 0 && <Text>{t("programmes:new.noEpisode")}</Text>}
      {open.length > 1 && <EpisodeChoice episodes={open} value={chosen} onChange={setChosen} />}
      {episode && (
        // Another shoulder needs a new draft, because each recording belongs to one shoulder.
        <ProgrammeEditor
          key={episode.id}
          patientId={patientId}
          episode={{ id: episode.id, side: episode.side }}
          start={EMPTY}
          draftKey={`new for ${episode.id}`}
          saveLabel={t("programmes:new.save")}
          onSave={save}
          onCancel={props.onCancel}
        >
          {(fields) => (
            <TextInput
              label={t("programmes:new.name")}
              required
              maw={600}
              value={name}
              error={fields.name}
              onChange={(event) => setName(event.currentTarget.value)}
            />
          )}
        </ProgrammeEditor>
      )}
    </>
  );
}

function EpisodeChoice(props: {
  episodes: Episode[];
  value: string | null;
  onChange: (episodeId: string) => void;
}) {
  return (
    <Radio.Group
      label={t("programmes:new.whichEpisode")}
      description={t("programmes:new.whichExplanation")}
      size="md"
      value={props.value}
      onChange={props.onChange}
    >
      <Stack gap="xs" mt="xs">
        {props.episodes.map((episode) => (
          <Radio
            key={episode.id}
            size="md"
            value={episode.id}
            label={t(`programmes:new.episode.${episode.side}`, {
              diagnosis: describeDiagnosis(episode) || t("programmes:new.noDiagnosis"),
            })}
          />
        ))}
      </Stack>
    </Radio.Group>
  );
}
