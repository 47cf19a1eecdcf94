import { Button, Card, Group, Select, Stack, Text, TextInput, Title } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { type FormEvent, useState } from "react";
import { api, type Episode, type Schemas } from "../../lib/api/client";
import { formatMoment, formatSide } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useEpisodes } from "../../lib/patientQueries";
import { translateServerText } from "../../lib/serverText";
import { ProblemNote } from "../../ui/ProblemNote";
import { useHasPermission, useUserName } from "../auth/hooks";
import { describeEffect } from "./PatientBanner";

type Contraindication = Schemas["Contraindication"];
type Kind = Schemas["ContraindicationKind"];

/**
 * The patient's contraindications, each with its effect, the person who noted it, a doctor's permission and the
 * resolution.
 */
export function Contraindications({ patientId }: { patientId: string }) {
  const writes = useHasPermission("write_records");
  const found = useQuery({
    queryKey: ["contraindications", patientId],
    queryFn: () => api.contraindications(patientId),
  });
  const episodes = useEpisodes(patientId).data?.items ?? [];
  const items = found.data?.items ?? [];
  const title = t("patients:contraindications.title");
  return (
    <Stack gap="xs" component="section" aria-label={title}>
      <Title order={2} size="h3">
        {title}
      </Title>
      <ProblemNote error={found.error} />
      {found.data && items.length === 0 && <Text>{t("patients:contraindications.none")}</Text>}
      {items.map((one) => (
        <Entry key={one.id} found={one} writes={writes} />
      ))}
      {writes && <AddForm patientId={patientId} episodes={episodes.filter(({ closed_at }) => !closed_at)} />}
    </Stack>
  );
}

/** Return a mutation after which the list and the banner are fetched again. */
function useChange<Variables>(change: (given: Variables) => Promise<Contraindication>) {
  const queries = useQueryClient();
  return useMutation({
    mutationFn: change,
    onSettled: () =>
      Promise.all([
        queries.invalidateQueries({ queryKey: ["contraindications"] }),
        queries.invalidateQueries({ queryKey: ["banner"] }),
      ]),
  });
}

function Entry({ found, writes }: { found: Contraindication; writes: boolean }) {
  const who = useUserName();
  const name = translateServerText(found.name, found.name_key);
  const signOff = useChange((doctor: string) => api.signOffContraindication(found.id, { doctor }));
  const resolve = useChange((reason: string) =>
    api.resolveContraindication(found.id, { reason, resolved_by: who }),
  );
  return (
    <Card
      withBorder
      padding="sm"
      component="article"
      aria-label={name}
      {...(found.resolved_at && { c: "dimmed" })}
    >
      <Text fw={600}>
        {name}
        {found.side && t("patients:contraindications.ofSide", { side: formatSide(found.side) })}
      </Text>
      {found.note && <Text style={{ whiteSpace: "pre-wrap" }}>{found.note}</Text>}
      <Text size="sm">
        {t("patients:contraindications.noted", { by: found.noted_by, at: formatMoment(found.noted_at) })}
      </Text>
      {found.resolved_at ? (
        <>
          {found.signed_off_at && <Text size="sm">{describeEffect(found)}</Text>}
          <Text size="sm">
            {t("patients:contraindications.resolved", {
              by: found.resolved_by,
              at: formatMoment(found.resolved_at),
              reason: found.resolution,
            })}
          </Text>
        </>
      ) : (
        <>
          <Text fw={600}>{describeEffect(found)}</Text>
          <Text size="sm">
            {t("patients:contraindications.source", {
              source: translateServerText(found.source, found.source_key),
            })}
          </Text>
          {writes && (
            <Group align="end" mt="xs">
              {found.effect === "sign_off" && !found.signed_off_at && (
                <OneField
                  label={t("patients:contraindications.doctor")}
                  action={t("patients:contraindications.signOff")}
                  onSubmit={signOff.mutate}
                />
              )}
              <OneField
                label={t("patients:contraindications.reason")}
                action={t("patients:contraindications.resolve")}
                onSubmit={resolve.mutate}
              />
            </Group>
          )}
          <ProblemNote error={signOff.error ?? resolve.error} />
        </>
      )}
    </Card>
  );
}

function OneField(props: { label: string; action: string; onSubmit: (value: string) => void }) {
  const [value, setValue] = useState("");
  const submit = (event: FormEvent) => {
    event.preventDefault();
    props.onSubmit(value.trim());
  };
  return (
    <form onSubmit={submit}>
      <Group align="end" gap="xs">
        <TextInput
          label={props.label}
          maxLength={100}
          value={value}
          onChange={(event) => setValue(event.currentTarget.value)}
        />
        <Button type="submit" variant="default" disabled={!value.trim()}>
          {props.action}
        </Button>
      </Group>
    </form>
  );
}

function AddForm({ patientId, episodes }: { patientId: string; episodes: Episode[] }) {
  const kinds = useQuery({ queryKey: ["contraindication-kinds"], queryFn: api.contraindicationKinds });
  const who = useUserName();
  const [code, setCode] = useState<Kind["code"] | null>(null);
  const [episodeId, setEpisodeId] = useState<string | null>(null);
  const [note, setNote] = useState("");
  const kind = kinds.data?.items.find((one) => one.code === code);
  const add = useChange((given: Kind["code"]) =>
    api.addContraindication(patientId, {
      code: given,
      note,
      noted_by: who,
      episode_id: kind?.scope === "episode" ? (episodeId ?? episodes[0]?.id ?? null) : null,
    }),
  );
  const clear = () => {
    setCode(null);
    setNote("");
  };
  const submit = (event: FormEvent) => {
    event.preventDefault();
    if (code) add.mutate(code, { onSuccess: clear });
  };
  return (
    <form onSubmit={submit}>
      <Group align="end">
        <Select
          label={t("patients:contraindications.kind")}
          w={340}
          data={(kinds.data?.items ?? []).map((one) => ({
            value: one.code,
            label: translateServerText(one.name, one.name_key),
          }))}
          value={code}
          onChange={(value) => setCode(value as Kind["code"] | null)}
        />
        {kind?.scope === "episode" && episodes.length > 1 && (
          <Select
            label={t("patients:contraindications.shoulder")}
            data={episodes.map(({ id, side }) => ({ value: id, label: formatSide(side) }))}
            value={episodeId ?? episodes[0]?.id ?? null}
            onChange={setEpisodeId}
          />
        )}
        <TextInput
          label={t("patients:contraindications.note")}
          value={note}
          maxLength={2000}
          onChange={(event) => setNote(event.currentTarget.value)}
        />
        <Button type="submit" disabled={!kind} loading={add.isPending}>
          {t("patients:contraindications.add")}
        </Button>
      </Group>
      {kind && (
        <Text size="sm" mt={4}>
          {t(`patients:contraindications.effects.${kind.effect}`)}{" "}
          {t("patients:contraindications.source", {
            source: translateServerText(kind.source, kind.source_key),
          })}
        </Text>
      )}
      <ProblemNote error={kinds.error ?? add.error} />
    </form>
  );
}
