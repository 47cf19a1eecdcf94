import { SegmentedControl, Stack, Text } from "@mantine/core";
import { useMutation } from "@tanstack/react-query";
import { api } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { LANGUAGE, LANGUAGES, type Language, switchLanguage } from "../../lib/language";
import { useControlsArm } from "../../safety/useControlsArm";
import { ProblemNote } from "../../ui/ProblemNote";

const CHOICES = Object.entries(LANGUAGES).map(([value, name]) => ({
  value,
  label: <span lang={value}>{name}</span>,
}));

/** The page's language. With `own` it is saved in the user's account, otherwise in this browser. */
export function LanguageChoice({ own = false }: { own?: boolean }) {
  // A new language reloads the page. This must not happen while the motors move or hold the arm.
  const moving = useControlsArm();
  const choose = useMutation({
    mutationFn: async (language: Language) => {
      if (own) await api.chooseLanguage(language);
      switchLanguage(language);
    },
  });
  return (
    <Stack gap="xs">
      <SegmentedControl
        size="md"
        aria-label={t("auth:language.label")}
        data={CHOICES}
        value={LANGUAGE}
        disabled={moving || choose.isPending}
        onChange={(chosen) => choose.mutate(chosen as Language)}
      />
      {own && <Text size="sm">{moving ? t("auth:language.notWhileMoving") : t("auth:language.hint")}</Text>}
      <ProblemNote error={choose.error} />
    </Stack>
  );
}
