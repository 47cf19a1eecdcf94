import { Button, Group, RangeSlider, Text } from "@mantine/core";
import { formatDeg } from "../../lib/format";
import { t } from "../../lib/i18n";
import type { PlotWindow } from "../../ui/plotWindow";

const STEPS = 50;

/**
 * Selects the part of a run that its figures show, by keyboard or finger, because dragging in a figure needs a
 * mouse. Null is the whole run.
 */
export function WindowSlider(props: {
  length_s: number;
  window: PlotWindow | null;
  onChange: (window: PlotWindow | null) => void;
}) {
  const { window, onChange } = props;
  const length_s = tenths(props.length_s);
  const step = tenths(length_s / STEPS);
  const start_s = window?.start_s ?? 0;
  const end_s = Math.min(window?.end_s ?? length_s, length_s);
  return (
    <Group role="group" aria-label={t("sessions:compared.shownPart")} gap="lg" mt="sm">
      <Text w={190} style={{ fontVariantNumeric: "tabular-nums" }} data-testid="window">
        {t("sessions:compared.shown", { from: formatDeg(start_s), to: formatDeg(end_s) })}
      </Text>
      <RangeSlider
        flex="1 1 9rem"
        size="lg"
        thumbSize={28}
        min={0}
        max={length_s}
        step={step}
        minRange={step}
        value={[start_s, end_s]}
        label={(value) => t("sessions:compared.seconds", { seconds: formatDeg(value) })}
        thumbFromLabel={t("sessions:compared.from")}
        thumbToLabel={t("sessions:compared.to")}
        onChange={([start, end]) =>
          onChange(start === 0 && end === length_s ? null : { start_s: start, end_s: end })
        }
      />
      <Button variant="default" h={44} disabled={window === null} onClick={() => onChange(null)}>
        {t("sessions:compared.all")}
      </Button>
    </Group>
  );
}

const tenths = (seconds: number) => Math.ceil(seconds * 10) / 10;
