import "./catalogue";
import { Alert, Card, Group, Stack, Table, Text, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useEffect, useState } from "react";
import { api, type Schemas } from "../../lib/api/client";
import { formatDegrees, formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useAlive, useLive } from "../../lib/live/hooks";
import { store } from "../../lib/live/store";
import { InlineSlot } from "../../ui/InlineSlot";
import { PageLink } from "../../ui/links";
import { WideTable } from "../../ui/WideTable";
import { liveAngles } from "../digital-twin/liveAngles";
import { bandHead, describeRatio, describeReference } from "./describeRatio";
import { LiveRhythmChart } from "./LiveRhythmChart";
import {
  type ArmPoint,
  armPoint,
  type LiveMotion,
  type SoundMotion,
  soundCurveOf,
  withPoint,
} from "./liveRhythm";
import { curveName } from "./rhythmFigure";

/**
 * The rhythm of the present take or playback: the scapula over the elevation of the arm beside the sound side, the
 * ratio by phase, and a notice while the scapula runs ahead.
 */
export function LiveRhythmCard({ patientId }: { patientId: string }) {
  const alive = useAlive();
  const rhythm = useLive("rhythm");
  const side = useLive("side");
  const stored = useQuery({
    queryKey: ["sound-rhythm", patientId],
    queryFn: () => api.soundRhythm(patientId),
    staleTime: 60_000,
  });
  const compares = stored.data !== undefined && stored.data.side !== null && stored.data.side !== side;
  const sound = compares ? stored.data.motions : NONE;
  const { motion, now } = useLiveMotion(sound);
  return (
    <Card withBorder component="section" aria-label={t("rhythm:live.title")}>
      <Stack gap="xs" className={alive ? "" : "stale"}>
        <Title order={2} size="h3">
          {t("rhythm:live.title")}
        </Title>
        <SoundNote stored={stored.data} side={side} used={comparedWith(sound, rhythm?.curves ?? [])} />
        <Lead motion={motion} />
        {rhythm && <LiveRhythmChart rhythm={rhythm} sound={sound} motion={motion} now={now} />}
        {rhythm && rhythm.curves.length > 0 ? (
          <Ratios curves={rhythm.curves} sound={sound} />
        ) : (
          <Text size="sm">{rhythm ? t("rhythm:live.raise") : t("rhythm:live.waits")}</Text>
        )}
        <Text size="sm">{t("rhythm:live.links")}</Text>
      </Stack>
    </Card>
  );
}

const NONE: SoundMotion[] = [];

/** Return the newest motion of the sound side in the plane of this motion. Before the plane is known, it is the newest of all. */
const comparedWith = (sound: SoundMotion[], curves: Schemas["RhythmCurve"][]): SoundMotion | undefined =>
  sound.find((motion) => curves.length === 0 || curves.some((curve) => soundCurveOf(curve, [motion])));

/**
 * Follow the arm with each state of the station. Only points of a recorded take or a playing recording belong to the
 * motion, not those of a held arm or one that is moved back.
 */
function useLiveMotion(sound: SoundMotion[]): { motion: LiveMotion | null; now: ArmPoint | null } {
  const [motion, setMotion] = useState<LiveMotion | null>(null);
  const [now, setNow] = useState<ArmPoint | null>(null);
  useEffect(
    () =>
      liveAngles.subscribe(() => {
        const live = store.get().live;
        const angles = liveAngles.get();
        if (!live?.rhythm || !angles) return;
        const [rhythm, point] = [live.rhythm, armPoint(angles, live.side)];
        setNow(point);
        if (point && moves(live)) setMotion((before) => withPoint(before, point, rhythm, sound));
      }),
    [sound],
  );
  return { motion, now };
}

const moves = ({ mode, run, teaching }: Pick<Schemas["Live"], "mode" | "run" | "teaching">) =>
  teaching ? teaching.recording : mode === "playing" && run !== null && !run.reversing;

/** Says with which recording the motion is compared, or why it is not. */
function SoundNote(props: {
  stored: Schemas["SoundRhythm"] | undefined;
  side: Schemas["Live"]["side"] | null;
  used: SoundMotion | undefined;
}) {
  const { stored, side, used } = props;
  if (!stored) return null;
  if (used)
    return (
      <Text size="sm">
        <InlineSlot
          words={(name) =>
            t("rhythm:compared", { recording: name, when: formatMoment(used.recording.taught_at) })
          }
        >
          <PageLink
            inherit
            to="/recordings/$recordingId"
            params={{ recordingId: used.recording.recording_id }}
          >
            {used.recording.name}
          </PageLink>
        </InlineSlot>
      </Text>
    );
  const reason = stored.side !== null && stored.side === side ? "sound_side" : stored.no_sound;
  return <Text size="sm">{t(`rhythm:noSound.${reason ?? "no_like_motion"}`)}</Text>;
}

/** Says that the scapula runs ahead now, and how far it did so in this motion. */
function Lead({ motion }: { motion: LiveMotion | null }) {
  if (!motion) return null;
  const { ahead, lead_deg, largest } = motion;
  return (
    <>
      <div role="status">
        {ahead && (
          <Alert color="violet" variant="outline" p="xs" data-testid="runs-ahead">
            <Text size="lg" fw={700}>
              {t("rhythm:live.ahead")}
            </Text>
          </Alert>
        )}
      </div>
      {/* Its height stays while the arm is lowered, when there is no comparison. */}
      <Group gap="lg" mih={26} data-testid="lead">
        {lead_deg !== null && <Text>{t("rhythm:live.lead", { lead: formatDegrees(lead_deg) })}</Text>}
        {largest && (
          <Text fw={600}>
            {t("rhythm:live.largest", {
              lead: formatDegrees(largest.lead_deg),
              at: formatDegrees(largest.elevation_deg, 0),
            })}
          </Text>
        )}
      </Group>
    </>
  );
}

/** The ratio of each phase of this motion, of the sound side and of healthy people. */
function Ratios({ curves, sound }: { curves: Schemas["RhythmCurve"][]; sound: SoundMotion[] }) {
  const bands = curves[0]?.bands ?? [];
  const rows = curves.flatMap((curve) => {
    const other = soundCurveOf(curve, sound);
    return other ? [curve, other] : [curve];
  });
  return (
    <WideTable minWidth={560} caption={t("rhythm:live.caption")} data-testid="live-ratios">
      <Table.Thead>
        <Table.Tr>
          <Table.Th>{t("rhythm:heads.curve")}</Table.Th>
          {bands.map((band) => (
            <Table.Th key={band.from_deg}>{bandHead(band)}</Table.Th>
          ))}
          <Table.Th>{t("rhythm:heads.published")}</Table.Th>
        </Table.Tr>
      </Table.Thead>
      <Table.Tbody>
        {rows.map((curve) => (
          <Table.Tr key={`${curve.of} ${curve.direction} ${curve.plane_deg}`}>
            <Table.Td>{curveName(curve, rows)}</Table.Td>
            {curve.bands.map((band) => (
              <Table.Td key={band.from_deg}>{describeRatio(band)}</Table.Td>
            ))}
            <Table.Td>{describeReference(curve)}</Table.Td>
          </Table.Tr>
        ))}
      </Table.Tbody>
    </WideTable>
  );
}
