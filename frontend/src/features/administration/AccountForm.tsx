import "./catalogue";
import { Button, Group, MultiSelect, Radio, Stack, TextInput } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { type FormEvent, useState } from "react";
import { type Account, api, ProblemError, type Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { ProblemNote } from "../../ui/ProblemNote";
import type { Role } from "../auth/messages";

type Props =
  | { account: Account; onDone: () => void }
  | { account?: never; onDone: (code: Schemas["OneTimeCode"]) => void };

type Values = { name: string; username: string; role: Role; stations: string[]; openid: string };

/** Return a mutation that creates or changes the account and then calls `onDone`. */
function useSaveAccount(props: Props) {
  const queries = useQueryClient();
  return useMutation({
    mutationFn: async ({ openid, username, ...values }: Values) => {
      if (!props.account) return api.createAccount({ username, ...values });
      const { id, updated_at } = props.account;
      const link = openid.trim() === (props.account.openid ?? "") ? {} : { openid };
      await api.updateAccount(id, { ...values, updated_at, ...link });
      return null;
    },
    onSuccess: (created) => {
      void queries.invalidateQueries({ queryKey: ["accounts"] });
      if (props.account) props.onDone();
      else if (created) props.onDone(created);
    },
  });
}

/**
 * Creates or changes an account. The account's user chooses the password, so that the administrator never knows
 * it.
 */
export function AccountForm(props: Props) {
  const { account } = props;
  const [values, setValues] = useState<Values>({
    name: account?.name ?? "",
    username: account?.username ?? "",
    role: account?.role ?? "therapist",
    stations: account?.stations ?? [],
    openid: account?.openid ?? "",
  });
  const change = (changed: Partial<Values>) => setValues((former) => ({ ...former, ...changed }));
  const save = useSaveAccount(props);
  const fields = save.error instanceof ProblemError ? save.error.fields : {};
  const submit = (event: FormEvent) => {
    event.preventDefault();
    save.mutate(values);
  };
  return (
    <form onSubmit={submit} noValidate>
      <Stack>
        <TextInput
          label={t("administration:form.name")}
          description={t("administration:form.nameHint")}
          required
          data-autofocus
          maxLength={100}
          value={values.name}
          error={fields.name}
          onChange={(event) => change({ name: event.currentTarget.value })}
        />
        {!account && (
          <UsernameField
            value={values.username}
            error={fields.username}
            onChange={(username) => change({ username })}
          />
        )}
        <RoleField value={values.role} onChange={(role) => change({ role })} />
        <StationsField value={values.stations} onChange={(stations) => change({ stations })} />
        {account && (
          <IdentityField
            account={account}
            value={values.openid}
            error={fields.openid}
            onChange={(openid) => change({ openid })}
          />
        )}
        <ProblemNote error={save.error} />
        <Group justify="end">
          <Button
            type="submit"
            loading={save.isPending}
            disabled={values.name.trim() === "" || values.username.trim() === ""}
          >
            {account ? t("administration:form.save") : t("administration:form.create")}
          </Button>
        </Group>
      </Stack>
    </form>
  );
}

type TextFieldProps = { value: string; error: string | undefined; onChange: (value: string) => void };

/** The new account's user name. */
function UsernameField({ value, error, onChange }: TextFieldProps) {
  return (
    <TextInput
      label={t("administration:form.username")}
      description={t("administration:form.usernameHint")}
      required
      maxLength={64}
      autoComplete="off"
      autoCapitalize="none"
      spellCheck={false}
      value={value}
      error={error}
      onChange={(event) => onChange(event.currentTarget.value)}
    />
  );
}

function RoleField({ value, onChange }: { value: Role; onChange: (role: Role) => void }) {
  return (
    <Radio.Group
      label={t("administration:form.role")}
      value={value}
      onChange={(chosen) => onChange(chosen as Role)}
    >
      <Stack gap="xs" mt="xs">
        {Object.entries(t("auth:roles", { returnObjects: true })).map(([code, words]) => (
          <Radio key={code} size="md" value={code} label={words.name} description={words.may} />
        ))}
      </Stack>
    </Radio.Group>
  );
}

/** The account's stations. The choices are the stations that have treated patients. */
function StationsField(props: { value: string[]; onChange: (stations: string[]) => void }) {
  const filterOptions = useQuery({ queryKey: ["session-choices"], queryFn: api.sessionFilterOptions });
  const choices = [...new Set([...(filterOptions.data?.stations ?? []), ...props.value])].sort();
  return (
    <>
      <MultiSelect
        label={t("administration:form.stations")}
        description={t("administration:form.stationsHint")}
        size="md"
        data={choices}
        value={props.value}
        onChange={props.onChange}
      />
      <ProblemNote error={filterOptions.error} />
    </>
  );
}

/**
 * The account's identity at the OpenID provider. The field is hidden if the clinic has no provider and the
 * account has no identity.
 */
function IdentityField({ account, value, error, onChange }: TextFieldProps & { account: Account }) {
  const loginMethods = useQuery({
    queryKey: ["sign-in-options"],
    queryFn: api.loginMethods,
    staleTime: Number.POSITIVE_INFINITY,
  });
  const provider = loginMethods.data?.openid ?? null;
  if (!provider && !account.openid) return null;
  return (
    <TextInput
      label={t("administration:form.identity", {
        provider: provider ?? t("administration:form.theProvider"),
      })}
      description={t("administration:form.identityHint")}
      maxLength={255}
      autoComplete="off"
      autoCapitalize="none"
      spellCheck={false}
      value={value}
      error={error}
      onChange={(event) => onChange(event.currentTarget.value)}
    />
  );
}
