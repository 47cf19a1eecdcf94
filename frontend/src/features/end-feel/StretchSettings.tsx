import "./catalogue";
import { Group, NumberInput } from "@mantine/core";
import { t } from "../../lib/i18n";
import { isWithin } from "../../ui/Stepper";

/** What the user has typed. An empty largest angle leaves it to the limits. */
type TypedStretch = {
  hold: number | string;
  repetitions: number | string;
  largest: number | string;
};

export const USUAL_STRETCH: TypedStretch = { hold: 30, repetitions: 3, largest: "" };

const HOLD = { min: 1, max: 120, step: 5 } as const;
const REPETITIONS = { min: 1, max: 20, step: 1 } as const;

/** Return the typed number, or NaN for an empty field. */
const toNumber = (typed: number | string) => (typed === "" ? Number.NaN : Number(typed));

/** Return true if a stretch can be loaded with these settings. */
export function isStretch({ hold, repetitions }: TypedStretch): boolean {
  return isWithin(HOLD, toNumber(hold)) && isWithin(REPETITIONS, toNumber(repetitions));
}

/** Return the settings as the service expects them. */
export function stretchRequest({ hold, repetitions, largest }: TypedStretch) {
  return {
    hold_s: Number(hold),
    repetitions: Number(repetitions),
    largest_deg: largest === "" ? null : Number(largest),
  };
}

/** Hold time, repetitions and largest angle of a stretch. */
export function StretchSettings({
  typed,
  change,
  end,
}: {
  typed: TypedStretch;
  change: (typed: TypedStretch) => void;
  end: string;
}) {
  return (
    <Group align="start">
      <NumberInput
        label={t("endFeel:stretch.hold")}
        {...HOLD}
        clampBehavior="none"
        value={typed.hold}
        onChange={(hold) => change({ ...typed, hold })}
        error={
          isWithin(HOLD, toNumber(typed.hold))
            ? null
            : t("endFeel:stretch.holdBetween", { shortest: HOLD.min, seconds: HOLD.max })
        }
      />
      <NumberInput
        label={t("endFeel:stretch.repetitions")}
        {...REPETITIONS}
        clampBehavior="none"
        allowDecimal={false}
        value={typed.repetitions}
        onChange={(repetitions) => change({ ...typed, repetitions })}
        error={
          isWithin(REPETITIONS, toNumber(typed.repetitions))
            ? null
            : t("endFeel:stretch.repetitionsBetween", { repetitions: REPETITIONS.max })
        }
      />
      <NumberInput
        label={t("endFeel:stretch.largest")}
        description={t("endFeel:stretch.largestHint", { end })}
        value={typed.largest}
        onChange={(largest) => change({ ...typed, largest })}
      />
    </Group>
  );
}
