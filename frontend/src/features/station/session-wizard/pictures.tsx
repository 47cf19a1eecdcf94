import type { ReactNode } from "react";
import type { Check, Recording } from "../../../lib/api/client";
import classes from "./sessionWizard.module.css";

type Fixture = Recording["fixtures"][number];

/**
 * Shows a picture of a check. The sentence beside it says the same, so the picture is optional. It is a
 * schematic after section 3.1.2 of the paper: the cuff that motor 5 turns, the fixer in the cuff that holds the
 * arm, and the support of the elbow.
 */
export function CheckPicture({ check }: { check: Check }) {
  switch (check.check) {
    case "side":
      return <SidePicture side={check.subject} />;
    case "fixtures":
      return <FixturesPicture fixtures={check.subject.split("+") as Fixture[]} />;
    case "belt":
      return <BeltPicture />;
    case "pedal":
      return <PedalPicture />;
    case "estop":
      return <EstopPicture />;
    case "identity":
      return null;
  }
}

function Picture({ children }: { children: ReactNode }) {
  return (
    <svg className={classes.picture ?? ""} viewBox="0 0 112 84" aria-hidden="true" focusable="false">
      {children}
    </svg>
  );
}

const body = { className: classes.body ?? "" };
const part = { className: classes.part ?? "" };
const line = { className: classes.line ?? "" };
const limb = { className: classes.limb ?? "" };
const cuff = { className: classes.cuff ?? "" };
const belt = { className: classes.belt ?? "" };

/**
 * Shows the fixtures: fixer 1 alone, or the longer fixer 2 with the elbow fixer of teaching (1) or playback
 * (2).
 */
function FixturesPicture({ fixtures }: { fixtures: Fixture[] }) {
  const has = (fixture: Fixture) => fixtures.includes(fixture);
  return (
    <Picture>
      {/* The patient with a level upper arm and an upright forearm. */}
      <circle {...body} cx="16" cy="13" r="10" />
      <path {...limb} d="M16 40 V78" />
      <path {...limb} d="M18 38 H88 V12" />
      {has("elbow_fixer_2") && <path {...part} d="M80 34 H96 V12 H104 V56 H84 V49 H96 V42 H80 Z" />}
      {has("elbow_fixer_1") && <path {...part} d="M96 26 H103 V56 H84 V49 H96 Z" />}
      {(has("elbow_fixer_1") || has("elbow_fixer_2")) && <path {...line} d="M79 28 H97" />}
      {has("elbow_fixer_2") && <path {...line} d="M79 18 H97" />}
      {has("arm_fixer_1") && <path {...part} d="M34 46 H64 Q64 55 58 55 H40 Q34 55 34 46 Z" />}
      {has("arm_fixer_2") && <path {...part} d="M28 46 H78 V55 H34 Q28 55 28 46 Z" />}
      {/* The cuff that motor 5 turns, and the belts. */}
      <path {...cuff} d="M49 57 Q42 38 49 21 Q56 38 49 57" />
      <path {...line} d={has("arm_fixer_2") ? "M34 29 V46 M64 29 V46 M73 29 V46" : "M38 29 V46 M60 29 V46"} />
    </Picture>
  );
}

/**
 * Shows the patient from behind, so that left is on the left, with the apparatus at that shoulder and its pin
 * inserted.
 */
function SidePicture({ side }: { side: string }) {
  return (
    <Picture>
      <g transform={side === "right" ? "matrix(-1 0 0 1 112 0)" : undefined}>
        <circle {...body} cx="68" cy="16" r="11" />
        <path {...body} d="M44 82 V46 Q44 34 56 34 H80 Q92 34 92 46 V82 Z" />
        <path {...part} d="M10 38 H42 V50 H10 Z" />
        <path {...line} d="M22 50 V82 M12 82 H32" />
        <path {...line} d="M26 18 V36 M20 18 H32 M22 30 L26 36 L30 30" />
      </g>
    </Picture>
  );
}

function BeltPicture() {
  return (
    <Picture>
      <path {...line} d="M26 14 V60 H64 M30 60 V82 M60 60 V82" />
      <circle {...body} cx="44" cy="12" r="10" />
      <path {...limb} d="M42 34 V50 H74 V74" />
      <path {...belt} d="M33 34 L52 54" />
    </Picture>
  );
}

function PedalPicture() {
  return (
    <Picture>
      <path {...limb} d="M40 8 V52 L76 60" />
      <path {...part} d="M22 80 V74 L96 64 V80 Z" />
    </Picture>
  );
}

function EstopPicture() {
  return (
    <Picture>
      <path {...limb} d="M34 70 H78" />
      <path {...part} d="M30 50 Q30 32 56 32 Q82 32 82 50 Z" />
      <path {...line} d="M48 50 V60 M64 50 V60" />
      <path {...line} d="M16 20 V44 M10 38 L16 44 L22 38 M96 44 V20 M90 26 L96 20 L102 26" />
    </Picture>
  );
}
