import { ActionIcon, Group, SegmentedControl, Stack, Text, UnstyledButton } from "@mantine/core";
import { IconMinus, IconPlus, IconRotate2, IconRotateClockwise2 } from "@tabler/icons-react";
import { type ReactNode, useEffect, useState, useSyncExternalStore } from "react";
import { formatDegrees } from "../../lib/format";
import { t } from "../../lib/i18n";
import { movedView, VIEWS, type View, type ViewName, viewOf } from "./camera";
import { SCENE_COLOURS } from "./colours";
import classes from "./digitalTwin.module.css";
import type { AnglesSource } from "./ghost";
import { type Limits, limitsReached, MOTORS, type Motor } from "./limits";
import { postureOf } from "./posture";
import { Scene } from "./Scene";
import { useScheme } from "./useScheme";
import type { Side } from "./vectors";

const TURN_DEG = 20;
const ZOOM_STEP = 1.25;

interface Props {
  side: Side;
  limits: Limits;
  /** The arm's measured angles; null on the page of a recording. */
  real: AnglesSource | null;
  /** The recording's angles; null without a recording. */
  ghost: AnglesSource | null;
  label: string;
  /** True on the station's page: the picture is smaller, and its other parts are shown on request. */
  compact?: boolean;
}

/** The apparatus, the patient and the arm in three dimensions, with a text alternative. */
export function ApparatusView({ side, limits, real, ghost, label, compact = false }: Props) {
  const [named, setNamed] = useState<ViewName | null>("corner");
  const [view, setView] = useState<View>(() => viewOf("corner", side));
  const [only, setOnly] = useState<Motor | null>(null);
  const [unable, setUnable] = useState(false);
  const scheme = useScheme();
  const look = (next: View, name: ViewName | null = null) => {
    setNamed(name);
    setView(next);
  };
  // The view is reset for the other shoulder.
  useEffect(() => {
    setNamed((name) => name ?? "corner");
    setView(viewOf("corner", side));
  }, [side]);
  return (
    <Stack gap="xs">
      <Group gap="xs" justify="space-between">
        <SegmentedControl
          aria-label={t("digital-twin:view.view")}
          size={compact ? "xs" : "md"}
          fullWidth={compact}
          w={compact ? "100%" : "auto"}
          value={named ?? ""}
          onChange={(name) => look(viewOf(name as ViewName, side), name as ViewName)}
          data={VIEWS.map((value) => ({ value, label: t(`digital-twin:views.${value}`) }))}
        />
        {!compact && <CameraButtons view={view} onView={look} />}
      </Group>
      <div
        className={classes.canvas ?? ""}
        data-compact={compact}
        style={{ background: `linear-gradient(${SCENE_COLOURS[scheme].background.join(", ")})` }}
      >
        {unable ? (
          <Text p="md">{t("digital-twin:view.no3d")}</Text>
        ) : (
          <Scene
            side={side}
            limits={limits}
            view={view}
            scheme={scheme}
            only={only}
            real={real}
            ghost={ghost}
            label={label}
            onView={look}
            onUnable={() => setUnable(true)}
          />
        )}
      </div>
      <DetailsWhenCompact compact={compact}>
        {compact && <CameraButtons view={view} onView={look} />}
        <MotorButtons only={only} onOnly={setOnly} />
        <TextAlternative source={real ?? ghost} side={side} limits={limits} />
      </DetailsWhenCompact>
    </Stack>
  );
}

/** Shows, in a compact view, its content only on request. */
function DetailsWhenCompact({ compact, children }: { compact: boolean; children: ReactNode }) {
  if (!compact) return children;
  return (
    <details>
      <summary className={classes.summary}>{t("digital-twin:view.more")}</summary>
      <Stack gap="xs" mt="xs">
        {children}
      </Stack>
    </details>
  );
}

/** Buttons that rotate and zoom the view. */
function CameraButtons({ view, onView }: { view: View; onView: (view: View) => void }) {
  const buttons = [
    {
      label: t("digital-twin:view.left"),
      Icon: IconRotateClockwise2,
      next: () => movedView(view, -TURN_DEG, 0),
    },
    { label: t("digital-twin:view.right"), Icon: IconRotate2, next: () => movedView(view, TURN_DEG, 0) },
    { label: t("digital-twin:view.zoomIn"), Icon: IconPlus, next: () => movedView(view, 0, 0, ZOOM_STEP) },
    {
      label: t("digital-twin:view.zoomOut"),
      Icon: IconMinus,
      next: () => movedView(view, 0, 0, 1 / ZOOM_STEP),
    },
  ];
  return (
    <Group gap={4}>
      {buttons.map(({ label, Icon, next }) => (
        <ActionIcon key={label} variant="default" size={44} aria-label={label} onClick={() => onView(next())}>
          <Icon size={22} />
        </ActionIcon>
      ))}
    </Group>
  );
}

/** Names what each motor moves. Pressing a button shows only that motor's range. */
function MotorButtons({ only, onOnly }: { only: Motor | null; onOnly: (motor: Motor | null) => void }) {
  const { motors, onMotor } = SCENE_COLOURS[useScheme()];
  return (
    <Group gap={6} role="group" aria-label={t("digital-twin:view.motors")}>
      {MOTORS.map((motor) => (
        <UnstyledButton
          key={motor}
          className={classes.motor ?? ""}
          aria-pressed={only === motor}
          onClick={() => onOnly(only === motor ? null : motor)}
        >
          <span className={classes.disc ?? ""} style={{ background: motors[motor], color: onMotor }}>
            {motor}
          </span>
          {t(`digital-twin:motorMotions.${motor}`)}
        </UnstyledButton>
      ))}
    </Group>
  );
}

/** A text alternative to the drawing. It is in whole degrees, so that it does not change too fast to read. */
function TextAlternative({
  source,
  side,
  limits,
}: {
  source: AnglesSource | null;
  side: Side;
  limits: Limits;
}) {
  const serialized = useSyncExternalStore(
    source?.subscribe ?? subscribeToNothing,
    // Compared as a text, because the content matters and not the object.
    () => JSON.stringify(describeAngles(source, side, limits)),
  );
  const { body, notes } = JSON.parse(serialized) as ReturnType<typeof describeAngles>;
  return (
    <div data-testid="apparatus-words">
      {body && (
        <dl className={classes.body ?? ""}>
          {t("digital-twin:bodyMotions", { returnObjects: true }).map((name, n) => (
            <div key={name}>
              <dt>{name}</dt>
              <dd>{body[n]}</dd>
            </div>
          ))}
        </dl>
      )}
      {notes.map((note) => (
        <Text key={note} fw={600}>
          {note}
        </Text>
      ))}
      <Text size="sm" c="dimmed">
        {t("digital-twin:view.elbow")}
      </Text>
    </div>
  );
}

const subscribeToNothing = () => () => {};

function describeAngles(source: AnglesSource | null, side: Side, limits: Limits) {
  const angles = source?.get() ?? null;
  if (angles === null) return { body: null, notes: [t("digital-twin:view.noAngles")] };
  const posture = postureOf(angles, side);
  const limitOf = limitsReached(angles, limits);
  const notes = MOTORS.flatMap((motor) => {
    const end = limitOf[motor - 1];
    return end ? [t(`digital-twin:atLimit.${end}`, { motor })] : [];
  });
  if (posture === null) return { body: null, notes: [t("digital-twin:view.noPose"), ...notes] };
  return { body: posture.pose_deg.map((angle) => formatDegrees(angle, 0)), notes };
}
