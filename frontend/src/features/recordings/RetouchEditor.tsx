import "./catalogue";
import { Button, Group, SimpleGrid, Skeleton, Stack, Text } from "@mantine/core";
import { IconArrowBackUp, IconPlus, IconTrash } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { api, type Recording } from "../../lib/api/client";
import { formatDeg } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useStation } from "../../lib/live/hooks";
import { ProblemNote } from "../../ui/ProblemNote";
import { Stepper } from "../../ui/Stepper";
import { MotorButtons } from "./MotorButtons";
import { RetouchChart } from "./RetouchChart";
import { MOST_DEG, marksRoom, newPoint, type Point, roomOf } from "./retouch";
import classes from "./retouch.module.css";
import type { RetouchState } from "./useRetouch";

/** Changes a motor's curve between two marks: adds points, and moves them by pointer, arrow keys or numbers. */
export function RetouchEditor({ recording, retouch }: { recording: Recording; retouch: RetouchState }) {
  const motion = useQuery({
    queryKey: ["recording-motion", recording.id],
    queryFn: () => api.recordingMotion(recording.id),
    staleTime: Number.POSITIVE_INFINITY,
  });
  const limits = useStation()?.axes.find((axis) => axis.motor === retouch.motor);
  return (
    <Stack
      onKeyDown={(event) => {
        // A text field has its own undo.
        if (
          !(event.ctrlKey || event.metaKey) ||
          event.key !== "z" ||
          event.target instanceof HTMLInputElement
        )
          return;
        event.preventDefault();
        retouch.undo();
      }}
    >
      <MotorButtons
        label={t("recordings:retouch.motor")}
        chosen={[retouch.motor]}
        onPress={retouch.chooseMotor}
      />
      <ProblemNote error={motion.error} />
      {motion.isPending && <Skeleton h={320} />}
      {motion.data && <RetouchChart motion={motion.data} limits={limits} retouch={retouch} />}
      <Keys limits={limits} />
      <Buttons retouch={retouch} />
      <Numbers retouch={retouch} duration_s={recording.duration_s} />
    </Stack>
  );
}

/** Explains the lines of the chart, and states the limits, which may be out of view. */
function Keys({ limits }: { limits: { min_deg: number; max_deg: number } | undefined }) {
  const sample = (line: string | undefined) => (
    <svg width={28} height={10} aria-hidden>
      <line className={line ?? ""} x1={0} x2={28} y1={5} y2={5} />
    </svg>
  );
  return (
    <div className={classes.keys}>
      <span className={classes.key}>
        {sample(classes.before)} {t("recordings:retouch.before")}
      </span>
      <span className={classes.key}>
        {sample(classes.after)} {t("recordings:retouch.after")}
      </span>
      {limits && (
        <span className={classes.key}>
          {sample(classes.limit)}
          {t("recordings:retouch.limits", {
            low: formatDeg(limits.min_deg, 0),
            high: formatDeg(limits.max_deg, 0),
          })}
        </span>
      )}
    </div>
  );
}

function Buttons({ retouch }: { retouch: RetouchState }) {
  const { part, motor, selected } = retouch;
  const added = newPoint(part, motor);
  const point = selected === null ? undefined : part.points[selected];
  return (
    <Group>
      <Button
        size="lg"
        variant="default"
        leftSection={<IconPlus size={22} />}
        disabled={!added}
        onClick={() => {
          if (!added) return;
          retouch.change({ ...part, points: [...part.points, added] });
          retouch.select(part.points.length);
        }}
      >
        {t("recordings:retouch.add")}
      </Button>
      <Button
        size="lg"
        variant="default"
        leftSection={<IconTrash size={22} />}
        disabled={!point}
        onClick={() => {
          retouch.change({ ...part, points: part.points.filter((_, n) => n !== selected) });
          retouch.select(null);
        }}
      >
        {t("recordings:retouch.remove")}
      </Button>
      <Button
        size="lg"
        variant="default"
        leftSection={<IconArrowBackUp size={22} />}
        disabled={!retouch.canUndo}
        onClick={retouch.undo}
      >
        {t("recordings:retouch.undo")}
      </Button>
    </Group>
  );
}

/** The numbers of both marks and of the selected point. */
function Numbers({ retouch, duration_s }: { retouch: RetouchState; duration_s: number }) {
  const { part, selected } = retouch;
  const room = marksRoom(part, duration_s);
  const seconds = { unit: t("recordings:edit.seconds"), step: 0.1 };
  const point = selected === null ? undefined : part.points[selected];
  const changePoint = (changed: Partial<Point>) =>
    retouch.change({
      ...part,
      points: part.points.map((one, n) => (n === selected ? { ...one, ...changed } : one)),
    });
  return (
    <>
      {point && selected !== null ? (
        <SimpleGrid cols={{ base: 1, sm: 2 }}>
          <Stepper
            field={{
              ...seconds,
              label: t("recordings:retouch.time"),
              ...roomOf(part, selected),
            }}
            value={point.at_s}
            onChange={(at_s) => changePoint({ at_s: rounded(at_s) })}
          />
          <Stepper
            field={{
              label: t("recordings:retouch.change"),
              unit: t("recordings:edit.deg"),
              step: 0.5,
              min: -MOST_DEG,
              max: MOST_DEG,
            }}
            value={point.change_deg}
            onChange={(change_deg) => changePoint({ change_deg })}
          />
        </SimpleGrid>
      ) : (
        <Text size="sm">{t("recordings:retouch.noPoint")}</Text>
      )}
      <SimpleGrid cols={{ base: 1, sm: 2 }}>
        <Stepper
          field={{ ...seconds, label: t("recordings:edit.from"), ...room.start }}
          value={part.start_s}
          onChange={(start_s) => retouch.change({ ...part, start_s: rounded(start_s) })}
        />
        <Stepper
          field={{ ...seconds, label: t("recordings:edit.to"), ...room.end }}
          value={part.end_s}
          onChange={(end_s) => retouch.change({ ...part, end_s: rounded(end_s) })}
        />
      </SimpleGrid>
    </>
  );
}

/** Remove the error of adding tenths. */
const rounded = (time_s: number) => Math.round(time_s * 1000) / 1000;
