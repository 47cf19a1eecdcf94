import { Badge, Group, Stack, Text, Title } from "@mantine/core";
import { IconAlertTriangle, IconHandStop } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import type { ReactNode } from "react";
import { api, ProblemError, type Schemas } from "../../lib/api/client";
import { formatDay, formatList, formatSide } from "../../lib/format";
import { t } from "../../lib/i18n";
import { translateServerText } from "../../lib/serverText";
import { PageLink } from "../../ui/links";
import { storeHeight } from "../../ui/storeHeight";
import classes from "./patients.module.css";

type Contraindication = Schemas["Contraindication"];

const storeBannerHeight = storeHeight("--kata-patient");

/** Interval between requests, because another user may record a contraindication while the page is open. */
const REFETCH_MS = 60_000;

/** Query who the patient is and what limits a motion. The service also answers without the database. */
export function usePatientBanner(patientId: string | undefined) {
  return useQuery({
    queryKey: ["banner", patientId],
    queryFn: () => api.patientBanner(patientId ?? ""),
    enabled: patientId !== undefined,
    refetchInterval: REFETCH_MS,
  });
}

/**
 * The banner of every page of a patient, and of the station while a patient is there. It stays visible. `name`
 * is shown until the banner is loaded, and if it cannot be loaded. `heading`: the name is the page's heading,
 * and `more` follows the other facts. `link`: the name leads to the patient's page.
 */
export function PatientBanner(props: {
  patientId: string | undefined;
  name?: string;
  heading?: boolean;
  link?: boolean;
  more?: ReactNode;
}) {
  const { patientId, name, heading = false, link = false, more } = props;
  const { data, error } = usePatientBanner(patientId);
  // The page itself shows how to open a restricted record.
  const restricted = error instanceof ProblemError && error.code === "restricted";
  if (patientId === undefined || (restricted && !heading)) return null;
  return (
    <section
      ref={storeBannerHeight}
      className={data ? classes.banner : `${classes.banner} ${classes.loading}`}
      aria-label={t("patients:banner.title")}
      data-testid="patient-banner"
    >
      {data ? (
        <Stack gap={4} className={classes.facts ?? ""}>
          <Identity
            banner={data}
            name={<Name {...{ patientId, name: data.name, heading, link }} />}
            more={more}
          />
          <Limits banner={data} />
        </Stack>
      ) : (
        <>
          {heading && <Name {...{ patientId, name: name ?? "", heading, link }} />}
          <Text fw={700}>
            {!heading && name}
            {error && t("patients:banner.unavailable")}
          </Text>
        </>
      )}
    </section>
  );
}

function Name(props: { patientId: string; name: string; heading: boolean; link: boolean }) {
  const { patientId, name, heading, link } = props;
  if (heading) {
    return (
      <Title order={1} size="h2">
        {name}
      </Title>
    );
  }
  return (
    <Text fw={700} fz="lg">
      {link ? (
        <PageLink inherit to="/patients/$patientId" params={{ patientId }}>
          {name}
        </PageLink>
      ) : (
        name
      )}
    </Text>
  );
}

function Identity(props: { banner: Schemas["PatientBanner"]; name: ReactNode; more: ReactNode }) {
  const { banner, name, more } = props;
  const born = banner.birth_date
    ? t("patients:banner.born", { day: formatDay(banner.birth_date), age: banner.age_years ?? 0 })
    : t("patients:banner.noBirthDate");
  return (
    <Group gap="md" align="baseline" style={{ rowGap: 0 }}>
      {name}
      {banner.kana && <Text lang="ja">{banner.kana}</Text>}
      <Text>{born}</Text>
      <Text>{t("patients:patient.number", { number: banner.clinic_number })}</Text>
      {banner.shoulders.map((shoulder) => (
        <Text key={shoulder.episode_id} fw={600}>
          {describeShoulder(shoulder)}
        </Text>
      ))}
      {banner.shoulders.length === 0 && <Text>{t("patients:banner.noEpisode")}</Text>}
      {more}
    </Group>
  );
}

function Limits({ banner }: { banner: Schemas["PatientBanner"] }) {
  const notes = banner.shoulders.filter(({ contraindications }) => contraindications);
  if (banner.contraindications.length === 0 && notes.length === 0) {
    return <Text size="sm">{t("patients:banner.noContraindications")}</Text>;
  }
  return (
    <Group gap="xs" data-testid="contraindications">
      {banner.contraindications.map((found) => (
        <Badge
          key={found.id}
          size="lg"
          radius="sm"
          tt="none"
          h="auto"
          variant={found.stops_motion ? "filled" : "outline"}
          color={found.stops_motion ? "grape.9" : "dark"}
          leftSection={found.stops_motion ? <IconHandStop size={18} /> : <IconAlertTriangle size={18} />}
          styles={{ label: { whiteSpace: "normal" } }}
        >
          {describeContraindication(found)}
        </Badge>
      ))}
      {notes.map((shoulder) => (
        <Text key={shoulder.episode_id} fw={600} style={{ whiteSpace: "pre-wrap" }}>
          {t(`station:station.contraindications.${shoulder.side}`)}
          {t("patients:banner.colon")}
          {shoulder.contraindications}
        </Text>
      ))}
    </Group>
  );
}

function describeShoulder({ side, stage }: Schemas["BannerShoulder"]): string {
  const shoulder = t(`station:station.shoulder.${side}`);
  return stage
    ? t("patients:banner.shoulderStage", { shoulder, stage: t(`episodes:stages.${stage}`) })
    : shoulder;
}

/** Return the condition, its shoulder, and its effect. */
function describeContraindication(found: Contraindication): string {
  const { side } = found;
  const name = translateServerText(found.name, found.name_key);
  return t("patients:banner.contraindication", {
    what: formatList([name, ...(side ? [formatSide(side)] : []), ...(found.note ? [found.note] : [])]),
    effect: describeEffect(found),
  });
}

/** Return the present effect of a contraindication. */
export function describeEffect(found: Contraindication): string {
  if (found.signed_off_at) return t("patients:contraindications.signedOff", { doctor: found.signed_off_by });
  return t(`patients:contraindications.effects.${found.effect}`);
}
